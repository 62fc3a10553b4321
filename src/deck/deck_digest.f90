!> What the states of a run depend on, as text for checkpoints: a line for each keyword of the deck,
!! with its digest and the first step of the deck whose states it changes. A run that is taken up
!! again in a step may differ in all that counts from later steps on.
module deck_digest
  use text, only: to_text, upper_case, squeezed
  use lexer, only: lexed_deck_t, line_text, append_text
  use deck_records, only: parsed_deck_t, record_t, option_text, step_of, n_deck_steps
  use keyword_spec, only: names_curve, names_set
  use sha256, only: sha256_t, add_to_digest, sha256_text
  implicit none
  private

  public :: digest_of_deck, digest_line

  integer, parameter :: n_digits = 16      !! of a digest: they show changes, not intent

contains

  !> Digests of all keywords with their options and data, parameters replaced, but for those that
  !! may always change. Data of *DYNAMIC have a line of their own and count from the next step on:
  !! the step under way may get another end. Comments, the files that the lines come from, and which
  !! of two names a keyword or an option goes by do not count.
  function digest_of_deck(deck) result(text)
    type(parsed_deck_t), intent(in) :: deck       !! checked, so that aliases have been replaced
    character(:), allocatable :: text
    integer :: i, used, from
    logical :: is_apart

    used = 0
    allocate (character(0) :: text)
    do i = 1, deck%lexed%n_blocks
      associate (block => deck%lexed%blocks(i))
        if (may_change(deck, block%keyword)) cycle
        is_apart = block%keyword == "DYNAMIC"
        from = first_step_of(deck, i)
        call append_text(text, used, digest_of_block(deck%lexed, i, from, .true., .not. is_apart))
        if (is_apart) call append_text(text, used, digest_of_block(deck%lexed, i, from + 1, &
                                                                   .false., .true.))
      end associate
    end do
    text = text(:used)
  end function digest_of_deck

  !> May a run be restarted with this keyword changed?
  pure logical function may_change(deck, keyword)
    type(parsed_deck_t), intent(in) :: deck
    character(*), intent(in) :: keyword
    integer :: i

    may_change = .false.
    do i = 1, size(deck%keywords)
      if (deck%keywords(i)%name == keyword) may_change = .not. deck%keywords(i)%is_in_digest
    end do
  end function may_change

  !> The first step whose states a keyword changes: its own; of a set or an amplitude, wherever it
  !! stands, that of the first keyword that names it. One that nothing names changes none.
  pure integer function first_step_of(deck, i) result(first)
    type(parsed_deck_t), intent(in) :: deck
    integer, intent(in) :: i               !! the block
    character(:), allocatable :: name
    integer :: j

    first = step_of(deck%records(i)%step)
    if (deck%records(i)%spec == 0) return
    if (all(deck%keywords(deck%records(i)%spec)%names /= [names_curve, names_set])) return
    name = upper_case(squeezed(option_text(deck%records(i), "NAME")))
    first = n_deck_steps(deck) + 1
    do j = 1, size(deck%records)
      if (j == i .or. step_of(deck%records(j)%step) >= first) cycle
      if (does_name(deck%records(j), name)) first = step_of(deck%records(j)%step)
    end do
  end function first_step_of

  !> Has a keyword this name as the value of an option or as a field?
  pure logical function does_name(record, name)
    type(record_t), intent(in) :: record
    character(*), intent(in) :: name
    integer :: k

    does_name = .true.
    if (allocated(record%options)) then
      do k = 1, size(record%options)
        if (.not. record%options(k)%is_given) cycle
        if (upper_case(squeezed(record%options(k)%value)) == name) return
      end do
    end if
    if (allocated(record%first)) then
      do k = 1, record%first(record%n_lines + 1) - 1
        if (.not. allocated(record%fields(k)%word)) cycle
        if (upper_case(squeezed(record%fields(k)%word)) == name) return
      end do
    end if
    does_name = .false.
  end function does_name

  !> The line of one keyword, or of its data.
  function digest_of_block(lexed, i, from, has_options, has_data) result(line)
    type(lexed_deck_t), intent(in) :: lexed
    integer, intent(in) :: i               !! the block
    integer, intent(in) :: from            !! the first step whose states it changes
    logical, intent(in) :: has_options     !! options count
    logical, intent(in) :: has_data        !! data lines count
    character(:), allocatable :: line
    type(sha256_t) :: digest
    character(64) :: digits
    integer :: j

    associate (block => lexed%blocks(i))
      call add_to_digest(digest, "*"//block%keyword)
      do j = 1, merge(size(block%options), 0, has_options)
        if (block%options(j)%name == "INPUT") cycle
        call add_to_digest(digest, ","//block%options(j)%name)
        if (block%options(j)%has_value) call add_to_digest(digest, "="//block%options(j)%value)
      end do
      do j = block%first, merge(block%last, 0, has_data)
        call add_to_digest(digest, new_line("a")//line_text(lexed%lines, j))
      end do
      digits = sha256_text(digest)
      line = digest_line(digits(:n_digits), from, "*"//block%keyword//" ("// &
                         lexed%files(block%file)%value//":"//to_text(block%line)//")")
    end associate
  end function digest_of_block

  !> A line of such a digest.
  pure function digest_line(digest, from, name) result(line)
    character(*), intent(in) :: digest     !! sixteen digits
    integer, intent(in) :: from            !! the first step of the deck whose states it changes
    character(*), intent(in) :: name       !! what it is of, for messages
    character(:), allocatable :: line

    line = digest//" "//to_text(from)//" "//name//new_line("a")
  end function digest_line

end module deck_digest
