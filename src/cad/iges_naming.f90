!> Surfaces of an IGES file by their directory numbers and labels, as a deck names them: one by one
!! or in ranges such as `37-115`, `F3-17` and `F3-F17`.
module iges_naming
  use input_errors, only: origin_t, add_error
  use text, only: string_t, to_text, read_integer, nearest_name, squeezed, upper_case
  use iges_directory, only: entry_name
  use iges_model, only: iges_model_t
  implicit none
  private

  public :: naming_t, find_number, find_label

  character(*), parameter :: digits = "0123456789"

  !> What messages say of the file and of the deck that names its surfaces.
  type :: naming_t
    character(:), allocatable :: path        !! of the file
    character(:), allocatable :: surfaces    !! which surfaces there may be
    type(origin_t) :: origin                 !! where the deck names them
    logical, allocatable :: is_surface(:)    !! of each entity: whether it may be named
    logical, allocatable :: is_in_ranges(:)  !! and whether a range may hold it
    character(:), allocatable :: does        !! what a range does with surfaces: `holds`
  end type naming_t

  !> Numbers behind the same letters.
  type :: range_t
    character(:), allocatable :: letters     !! upper case, may be empty
    integer :: first = 1, last = 0
  end type range_t

contains

  !> Mark a surface by its directory number, with or without D before it, or those of a range. What
  !! the file does not have is an error of the model.
  subroutine find_number(model, naming, word, is_named)
    type(iges_model_t), intent(inout) :: model
    type(naming_t), intent(in) :: naming
    character(*), intent(in) :: word
    logical, intent(inout) :: is_named(:)      !! shape (number of entities)
    type(range_t) :: range
    logical :: is_number, is_range
    integer :: first, n, i

    call read_range(word, range, is_range)
    if (is_range) is_range = range%letters == "" .or. range%letters == "D"
    if (is_range) then
      call take_range(model, naming, word, range, naming%is_in_ranges .and. &
                      [(2*i - 1 >= range%first .and. 2*i - 1 <= range%last, &
                        i=1, size(is_named))], is_named)
      return
    end if
    first = merge(2, 1, upper_case(word(1:1)) == "D" .and. len(word) > 1)
    call read_integer(word(first:), n, is_number)
    if (.not. is_number) then
      call add_error(model%file%errors, naming%origin, "`"//word//"` as the number of an entity", &
                     "directory numbers and ranges of them such as ""5,9,21-35""")
    else if (n < 1 .or. n >= 2*size(is_named) .or. mod(n, 2) == 0) then
      call add_error(model%file%errors, naming%origin, "entity D"//to_text(n)//", which `"// &
                     naming%path//"` does not have", "odd directory numbers from 1 to "// &
                     to_text(2*size(is_named) - 1))
    else if (.not. naming%is_surface((n + 1)/2)) then
      call add_error(model%file%errors, naming%origin, entry_name(model%entries, (n + 1)/2)// &
                     " as a tool", naming%surfaces)
    else
      is_named((n + 1)/2) = .true.
    end if
  end subroutine find_number

  !> Mark surfaces by their label, or those of a range of labels. A label that a trimmed
  !! surface shares with the one it trims, as `post cad` writes it, names the former alone. What the
  !! file does not have is an error of the model.
  subroutine find_label(model, naming, word, is_named)
    type(iges_model_t), intent(inout) :: model
    type(naming_t), intent(in) :: naming
    character(*), intent(in) :: word
    logical, intent(inout) :: is_named(:)      !! shape (number of entities)
    type(range_t) :: range
    type(string_t) :: labels(size(is_named))
    logical :: is_found(size(is_named)), is_range
    character(:), allocatable :: nearest
    integer :: i

    do i = 1, size(labels)
      labels(i)%value = ""
      if (naming%is_surface(i)) labels(i)%value = squeezed(upper_case(model%entries(i)%label))
      is_found(i) = labels(i)%value == squeezed(upper_case(word))
    end do
    is_range = .false.
    if (.not. any(is_found)) call read_range(word, range, is_range)
    if (is_range) then
      do i = 1, size(labels)
        if (naming%is_in_ranges(i)) is_found(i) = is_within(labels(i)%value, range)
      end do
      call take_range(model, naming, word, range, is_found, is_named)
      return
    end if
    associate (is_carrier => model%entries%is_part .and. model%entries%type /= 144)
      if (any(is_found .and. .not. is_carrier)) is_found = is_found .and. .not. is_carrier
    end associate
    is_named = is_named .or. is_found
    if (any(is_found)) return
    nearest = nearest_name(word, labels)
    if (nearest /= "") nearest = ", did you mean "//nearest//"?"
    call add_error(model%file%errors, naming%origin, "the label "//word// &
                   ", which no surface of `"//naming%path//"` has", &
                   "the label of a surface"//nearest)
  end subroutine find_label

  !> Mark what a range holds, or note why that is nothing.
  subroutine take_range(model, naming, word, range, is_found, is_named)
    type(iges_model_t), intent(inout) :: model
    type(naming_t), intent(in) :: naming
    character(*), intent(in) :: word
    type(range_t), intent(in) :: range
    logical, intent(in) :: is_found(:)
    logical, intent(inout) :: is_named(:)

    if (range%first > range%last) then
      call add_error(model%file%errors, naming%origin, "the range "//word// &
                     ", which runs backwards", "the smaller number first")
    else if (.not. any(is_found)) then
      call add_error(model%file%errors, naming%origin, "the range "//word// &
                     ", which "//naming%does//" no surface of `"//naming%path//"`", &
                     "numbers or labels of surfaces, which `igaform faces` lists")
    end if
    is_named = is_named .or. is_found
  end subroutine take_range

  !> Take a range apart, if a word is one.
  subroutine read_range(word, range, is_range)
    character(*), intent(in) :: word
    type(range_t), intent(out) :: range
    logical, intent(out) :: is_range
    character(:), allocatable :: from, to
    integer :: hyphen, n
    logical :: has_last

    is_range = .false.
    hyphen = index(word, "-", back=.true.)
    if (hyphen < 2) return
    from = squeezed(upper_case(word(:hyphen - 1)))
    to = squeezed(upper_case(word(hyphen + 1:)))
    n = verify(from, digits, back=.true.)
    range%letters = from(:n)
    if (index(to, range%letters) == 1) to = to(n + 1:)
    if (verify(to, digits) > 0) return
    call read_integer(from(n + 1:), range%first, is_range)
    call read_integer(to, range%last, has_last)
    is_range = is_range .and. has_last
  end subroutine read_range

  !> Whether a label is one of a range.
  logical function is_within(label, range)
    character(*), intent(in) :: label          !! upper case
    type(range_t), intent(in) :: range
    integer :: number, n

    n = len(range%letters)
    is_within = .false.
    if (len(label) <= n) return
    if (label(:n) /= range%letters .or. verify(label(n + 1:), digits) > 0) return
    call read_integer(label(n + 1:), number, is_within)
    is_within = is_within .and. number >= range%first .and. number <= range%last
  end function is_within

end module iges_naming
