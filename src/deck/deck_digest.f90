!> The key of a deck for checkpoints: it changes with everything that may not change when a run is
!! taken up again.
module deck_digest
  use sha256, only: sha256_t, add_to_digest, sha256_text
  use text, only: to_text
  use lexer, only: lexed_deck_t
  use data_lines, only: line_text, append_text
  use deck_records, only: parsed_deck_t
  implicit none
  private

  public :: digest_of_deck, digest_line

  integer, parameter :: n_digits = 16      !! of a digest: they show changes, not intent

contains

  !> Digests of all keywords with their options and data, parameters replaced, but for those that
  !! may change and the data of the last *DYNAMIC: a line for each, with its name and place.
  !! Comments, the files that the lines come from, and which of two names a keyword or an option
  !! goes by do not count.
  function digest_of_deck(deck) result(text)
    type(parsed_deck_t), intent(in) :: deck       !! checked, so that aliases have been replaced
    character(:), allocatable :: text
    character(:), allocatable :: line
    integer :: i, last_dynamic, used

    used = 0
    last_dynamic = 0
    do i = 1, deck%lexed%n_blocks
      if (deck%lexed%blocks(i)%keyword == "DYNAMIC") last_dynamic = i
    end do
    allocate (character(0) :: text)
    do i = 1, deck%lexed%n_blocks
      if (may_change(deck, deck%lexed%blocks(i)%keyword)) cycle
      line = digest_of_block(deck%lexed, i, i /= last_dynamic)
      call append_text(text, used, line)
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

  !> The line of one keyword.
  function digest_of_block(lexed, i, has_data) result(line)
    type(lexed_deck_t), intent(in) :: lexed
    integer, intent(in) :: i               !! the block
    logical, intent(in) :: has_data        !! its data lines count
    character(:), allocatable :: line
    type(sha256_t) :: digest
    character(64) :: digits
    integer :: j

    associate (block => lexed%blocks(i))
      call add_to_digest(digest, "*"//block%keyword)
      do j = 1, size(block%options)
        if (block%options(j)%name == "INPUT") cycle
        call add_to_digest(digest, ","//block%options(j)%name)
        if (block%options(j)%has_value) call add_to_digest(digest, "="//block%options(j)%value)
      end do
      do j = block%first, merge(block%last, 0, has_data)
        call add_to_digest(digest, new_line("a")//line_text(lexed%lines, j))
      end do
      digits = sha256_text(digest)
      line = digest_line(digits(:n_digits), "*"//block%keyword//" ("// &
                         lexed%files(block%file)%value//":"//to_text(block%line)//")")
    end associate
  end function digest_of_block

  !> A line of such a digest.
  pure function digest_line(digest, name) result(line)
    character(*), intent(in) :: digest     !! sixteen digits
    character(*), intent(in) :: name       !! what it is of, for messages
    character(:), allocatable :: line

    line = digest//" "//name//new_line("a")
  end function digest_line

end module deck_digest
