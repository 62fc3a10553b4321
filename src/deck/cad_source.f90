!> What keywords share that take geometry from files of other programs: the unit of its lengths, and
!! how such files count to the deck.
module cad_source
  use kinds, only: wp
  use text, only: string_t, squeezed, upper_case, lower_case
  use checksum, only: file_checksum
  use input_errors, only: error_list_t, add_error, add_warning
  use text_file, only: read_whole_file
  use nurbs_surface, only: nurbs_surface_t
  use iges_global, only: unit_in_mm
  use iges_reader, only: read_iges
  use iges_selection, only: iges_request_t
  use scene, only: scene_t
  use deck_records, only: record_t, option_text, step_of
  use deck_digest, only: digest_line
  implicit none
  private

  public :: add_source, ending_of, is_for_converter, read_cad_file, find_unit, entries_of

contains

  !> A file that is no text of the deck counts to it all the same: by its checksum, from the step of
  !! the keyword on that names it.
  subroutine add_source(record, scene, file)
    type(record_t), intent(in) :: record
    type(scene_t), intent(inout) :: scene
    type(string_t), intent(in) :: file
    type(string_t) :: sum

    sum%value = file_checksum(file%value)
    scene%files = [scene%files, file]
    scene%sums = [scene%sums, sum]
    scene%text = scene%text//"** file "//file%value//", checksum "//sum%value//new_line("a")
    scene%digest = scene%digest//digest_line(sum%value, step_of(record%step), &
                                             "the file '"//file%value//"'")
  end subroutine add_source

  !> What follows the last point of a path, in small letters.
  pure function ending_of(path) result(ending)
    character(*), intent(in) :: path
    character(:), allocatable :: ending

    ending = lower_case(path(index(path, ".", back=.true.) + 1:))
  end function ending_of

  !> Is a file, by its name, a mesh of facets?
  pure logical function is_mesh(path)
    character(*), intent(in) :: path

    is_mesh = any(ending_of(path) == [character(3) :: "stl", "obj", "ply", "off", "3mf"])
  end function is_mesh

  !> Surfaces of an IGES file and lines about them, see `read_iges`; without surfaces on an error,
  !! such as a file of another kind.
  subroutine read_cad_file(request, surfaces, report, errors)
    type(iges_request_t), intent(in) :: request
    type(nurbs_surface_t), allocatable, intent(out) :: surfaces(:)   !! in the unit of the request
    type(string_t), allocatable, intent(out) :: report(:)
    type(error_list_t), intent(inout) :: errors
    logical :: is_there

    allocate (surfaces(0), report(0))
    inquire (file=request%path, exist=is_there)
    if (.not. is_there) then
      call add_error(errors, request%origin, "no file `"//request%path//"`", &
                     "the path of an IGES file, in a deck relative to its folder")
    else if (is_for_converter(request%path)) then
      call add_error(errors, request%origin, "`"//request%path//"`, a STEP or BREP file", &
                     "the IGES file that `python -m post cad "//request%path// &
                     " --out NAME.igs` makes of it")
    else if (is_mesh(request%path)) then
      call add_error(errors, request%origin, "`"//request%path//"`, a mesh, whose facets have "// &
                     "no curvature", "an IGES file of surfaces, or a STEP file for "// &
                     "`python -m post cad`")
    else
      call read_iges(request, surfaces, report, errors)
    end if
  end subroutine read_cad_file

  !> Is a file, by its first bytes, STEP (ISO 10303-21) or BREP of OpenCASCADE?
  logical function is_for_converter(path)
    character(*), intent(in) :: path
    integer, parameter :: n_bytes = 256
    character(:), allocatable :: head
    logical :: is_there

    call read_whole_file(path, head, is_there, n_bytes)
    is_for_converter = index(head, "ISO-10303-21") > 0 .or. index(head, "CASCADE Topology") > 0 &
                       .or. index(head, "DBRep_DrawableShape") == 1
  end function is_for_converter

  !> The deck's unit of length: that of LENGTH, else that of *UNITS, else millimetres.
  subroutine find_unit(record, units, unit, errors)
    type(record_t), intent(in) :: record
    character(*), intent(in) :: units                     !! what *UNITS says, empty: nothing
    character(:), allocatable, intent(out) :: unit
    type(error_list_t), intent(inout) :: errors
    character(:), allocatable :: labelled
    type(string_t), allocatable :: named(:)
    integer :: i

    labelled = ""
    named = entries_of(units)
    do i = size(named), 1, -1
      if (unit_in_mm(named(i)%value) > 0.0_wp) labelled = upper_case(named(i)%value)
    end do
    unit = option_text(record, "LENGTH")
    if (unit == "" .and. labelled /= "") unit = labelled
    if (unit == "") unit = "MM"
    if (labelled == "") return
    if (abs(unit_in_mm(unit) - unit_in_mm(labelled)) > 0.0_wp) &
      call add_warning(errors, record%origin, "LENGTH="//unit//" in a deck whose *UNITS names "// &
                       labelled//": lengths of the file become "//unit, "LENGTH="//labelled// &
                       ", or no LENGTH")
  end subroutine find_unit

  !> The entries of a list that commas separate; empty ones are left out.
  pure function entries_of(list) result(entries)
    character(*), intent(in) :: list
    type(string_t), allocatable :: entries(:)
    type(string_t) :: entry
    integer :: first, length

    allocate (entries(0))
    first = 1
    do while (first <= len(list))
      length = index(list(first:)//",", ",") - 1
      entry%value = squeezed(list(first:first + length - 1))
      if (entry%value /= "") entries = [entries, entry]
      first = first + length + 1
    end do
  end function entries_of

end module cad_source
