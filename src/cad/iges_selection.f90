!> Which entities of an IGES file become surfaces of a tool, and why the others do not.
module iges_selection
  use kinds, only: wp
  use input_errors, only: origin_t, add_error, add_warning, n_errors
  use text, only: string_t, to_text, append_text, counted
  use iges_directory, only: entry_t, entry_name, entry_title, type_name
  use iges_global, only: unit_in_mm
  use iges_model, only: iges_model_t, entry_origin, reject_entity
  use iges_naming, only: naming_t, find_number, find_label
  implicit none
  private

  public :: iges_request_t, new_request, select_entries, bounded_lines, skipped_lines, &
            length_factor

  !> What a deck asks for.
  type :: iges_request_t
    character(:), allocatable :: path
    type(origin_t) :: origin                       !! where the deck asks
    character(:), allocatable :: unit              !! of the deck's lengths, one of `unit_names`
    type(string_t), allocatable :: numbers(:)      !! directory numbers of surfaces, or ranges
    type(string_t), allocatable :: labels(:)       !! and labels; neither: all that may be
    type(string_t), allocatable :: numbers_left_out(:), labels_left_out(:)   !! of these
    logical :: with_extents = .false.              !! the report has area and box of each surface
    logical :: is_listing = .false.                !! and says which cannot be read, without error
  end type iges_request_t

  integer, parameter :: is_taken = 0, is_no_surface = 1, is_part = 2, is_blanked = 3, &
                        is_no_geometry = 4, is_unread = 5, is_not_chosen = 6, is_bounded = 7
  character(*), parameter :: reasons(7) = [character(40) :: "no surface", &
    "part of another entity", "blanked, not to be seen", "not geometry by its use flag", &
    "a kind of surface that is not read", "not chosen", "bounded in space"]

  integer, parameter :: surfaces_read(4) = [120, 122, 128, 144]
  integer, parameter :: bounded(4) = [141, 142, 143, 510]   ! all but by loops of parameters
  integer, parameter :: surfaces_unread(9) = [108, 114, 118, 140, 190, 192, 194, 196, 198]
  integer, parameter :: most_told = 10
  character(*), parameter :: hint = "surfaces of types 144, 128, 120 and 122"

contains

  !> All surfaces of a file, in millimetres, with area and box.
  function new_request(path, origin) result(request)
    character(*), intent(in) :: path
    type(origin_t), intent(in) :: origin           !! where the file is named
    type(iges_request_t) :: request

    request%path = path
    request%origin = origin
    request%unit = "MM"
    allocate (request%numbers(0), request%labels(0))
    allocate (request%numbers_left_out(0), request%labels_left_out(0))
    request%with_extents = .true.
  end function new_request

  !> The reason why each entity is left out, 0 for those that are taken. What the deck asks for and
  !! cannot have is an error, as is a surface bounded in space but in a list; other surfaces are
  !! warned of.
  subroutine select_entries(model, request, reason)
    type(iges_model_t), intent(inout) :: model
    type(iges_request_t), intent(in) :: request
    integer, allocatable, intent(out) :: reason(:)   !! shape (number of entities)
    type(naming_t) :: naming
    integer :: i, n_before

    allocate (reason(size(model%entries)))
    do i = 1, size(reason)
      reason(i) = nature(model%entries(i))
    end do
    naming%path = request%path
    naming%surfaces = hint
    naming%origin = request%origin
    naming%is_surface = [(any(model%entries(i)%type == [surfaces_read, bounded]), &
                          i=1, size(reason))]
    naming%is_in_ranges = is_chosen(reason)
    naming%does = "holds"
    n_before = n_errors(model%file%errors)
    if (size(request%numbers) > 0 .or. size(request%labels) > 0) then
      call choose(model, naming, request, reason)
    else
      call warn_of_unread(model, reason)
    end if
    ! With an error the choice is not whole: then any surface may be left out.
    naming%is_in_ranges = is_chosen(reason) .or. &
                          (naming%is_in_ranges .and. n_errors(model%file%errors) > n_before)
    naming%does = "leaves out"
    call leave_out(model, naming, request, reason)
    if (.not. request%is_listing) call refuse_bounded(model, reason)
  end subroutine select_entries

  !> Is an entity to become part of the tool, whether or not it can be read?
  elemental logical function is_chosen(reason)
    integer, intent(in) :: reason

    is_chosen = reason == is_taken .or. reason == is_bounded
  end function is_chosen

  !> Length in the deck over length in the file.
  pure real(wp) function length_factor(model, request)
    type(iges_model_t), intent(in) :: model
    type(iges_request_t), intent(in) :: request

    length_factor = unit_in_mm(model%global%unit)/unit_in_mm(request%unit)/model%global%scale
  end function length_factor

  !> Lines such as `skipped 12 x type 110 (line): no surface`, one for each type and reason.
  function skipped_lines(model, reason) result(lines)
    type(iges_model_t), intent(in) :: model
    integer, intent(in) :: reason(:)
    type(string_t), allocatable :: lines(:)
    integer :: pairs(2, 100), counts(100), n, i, k
    type(string_t) :: line

    n = 0
    counts = 0
    do i = 1, size(reason)
      if (reason(i) == is_taken .or. model%entries(i)%type == 0) cycle
      do k = 1, n
        if (all(pairs(:, k) == [model%entries(i)%type, reason(i)])) exit
      end do
      if (k > n .and. n < size(counts)) then
        n = n + 1
        pairs(:, n) = [model%entries(i)%type, reason(i)]
      end if
      k = min(k, size(counts))
      counts(k) = counts(k) + 1
    end do
    allocate (lines(0))
    do k = 1, n
      line%value = "skipped "//to_text(counts(k))//" x type "//to_text(pairs(1, k))
      if (type_name(pairs(1, k)) /= "") line%value = line%value//" ("//type_name(pairs(1, k))//")"
      line%value = line%value//": "//trim(reasons(pairs(2, k)))
      lines = [lines, line]
    end do
  end function skipped_lines

  !> What an entity is by itself. A surface that is part of another entity is trimmed by it, or
  !! placed by it, or both.
  pure integer function nature(entry) result(reason)
    type(entry_t), intent(in) :: entry

    if (any(entry%type == bounded(:2)) .and. entry%is_part) then
      reason = is_part   ! what it trims is rejected
    else if (.not. any(entry%type == [surfaces_read, surfaces_unread, bounded])) then
      reason = is_no_surface
    else if (entry%is_blanked) then
      reason = is_blanked
    else if (any(entry%type == bounded)) then
      reason = is_bounded
    else if (entry%is_part .and. entry%type /= 144) then
      reason = is_part
    else if (entry%purpose /= 0) then
      reason = is_no_geometry
    else if (any(entry%type == surfaces_unread)) then
      reason = is_unread
    else
      reason = is_taken
    end if
  end function nature

  !> Take what the deck names, blanked or not, and nothing else.
  subroutine choose(model, naming, request, reason)
    type(iges_model_t), intent(inout) :: model
    type(naming_t), intent(in) :: naming
    type(iges_request_t), intent(in) :: request
    integer, intent(inout) :: reason(:)
    logical :: is_named(size(reason))
    integer :: i

    is_named = any(named(model, naming, request%numbers, request%labels), 2)
    do i = 1, size(reason)
      if (is_named(i)) then
        reason(i) = merge(is_bounded, is_taken, any(model%entries(i)%type == bounded))
      else if (any(reason(i) == [is_taken, is_bounded, is_unread])) then
        reason(i) = is_not_chosen
      end if
    end do
  end subroutine choose

  !> Leave out what the deck excludes. A number or a label that leaves out nothing is an error.
  subroutine leave_out(model, naming, request, reason)
    type(iges_model_t), intent(inout) :: model
    type(naming_t), intent(in) :: naming
    type(iges_request_t), intent(in) :: request
    integer, intent(inout) :: reason(:)
    logical, allocatable :: is_named(:, :)
    integer :: word, i

    is_named = named(model, naming, request%numbers_left_out, request%labels_left_out)
    do word = 1, size(is_named, 2)
      i = findloc(is_named(:, word), .true., 1)
      if (i == 0 .or. any(is_named(:, word) .and. naming%is_in_ranges)) cycle
      call add_error(model%file%errors, naming%origin, entry_name(model%entries, i)// &
                     " to be left out, which is not taken: "//trim(reasons(reason(i))), &
                     "surfaces that are taken, which `igaform faces` lists")
    end do
    where (any(is_named, 2) .and. is_chosen(reason)) reason = is_not_chosen
  end subroutine leave_out

  !> Which entities each of the numbers and labels names, shape (number of entities, names).
  function named(model, naming, numbers, labels) result(is_named)
    type(iges_model_t), intent(inout) :: model
    type(naming_t), intent(in) :: naming
    type(string_t), intent(in) :: numbers(:), labels(:)
    logical :: is_named(size(model%entries), size(numbers) + size(labels))
    integer :: i

    is_named = .false.
    do i = 1, size(numbers)
      call find_number(model, naming, numbers(i)%value, is_named(:, i))
    end do
    do i = 1, size(labels)
      call find_label(model, naming, labels(i)%value, is_named(:, size(numbers) + i))
    end do
  end function named

  !> A line for each surface that is chosen and bounded in space.
  function bounded_lines(model, reason) result(lines)
    type(iges_model_t), intent(in) :: model
    integer, intent(in) :: reason(:)
    type(string_t), allocatable :: lines(:)
    integer :: i

    allocate (lines(0))
    do i = 1, size(reason)
      if (reason(i) == is_bounded) call append_text(lines, entry_title(model%entries, i)// &
                                            ", not read: "//trim(reasons(is_bounded)))
    end do
  end function bounded_lines

  subroutine refuse_bounded(model, reason)
    type(iges_model_t), intent(inout) :: model
    integer, intent(in) :: reason(:)
    integer :: i, n

    n = 0
    do i = 1, size(reason)
      if (reason(i) /= is_bounded) cycle
      n = n + 1
      if (n == most_told) then
        call reject_entity(model, i, counted(count(reason == is_bounded) - n + 1, &
                           "bounded surface")//" more", hint)
        return
      end if
      call reject_entity(model, i, "a surface or curve bounded in space, which is not read", &
                         hint//": convert the file with `python -m post cad`, or name "// &
                         "surfaces of it with ENTITY= or LABEL=")
    end do
  end subroutine refuse_bounded

  !> One warning for each kind of surface that is left out.
  subroutine warn_of_unread(model, reason)
    type(iges_model_t), intent(inout) :: model
    integer, intent(in) :: reason(:)
    integer :: i, k, n

    do k = 1, size(surfaces_unread)
      associate (is_of_kind => model%entries%type == surfaces_unread(k) .and. reason == is_unread)
        n = count(is_of_kind)
        i = findloc(is_of_kind, .true., 1)
      end associate
      if (n > 0) call add_warning(model%file%errors, entry_origin(model, i), to_text(n)// &
        " of this type, which is not read: a part of the tool may be missing", hint)
    end do
  end subroutine warn_of_unread

end module iges_selection
