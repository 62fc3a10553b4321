!> Reads IGES files as a deck would, path by path from the standard input, for fuzz.py.
program fuzz_iges
  use faults, only: fault_list_t, new_origin, n_errors
  use text, only: string_t
  use nurbs_surface, only: nurbs_surface_t
  use iges_selection, only: iges_request_t
  use iges_reader, only: read_iges
  use fuzz_talk, only: next_path, answer_with
  implicit none

  character(:), allocatable :: path

  do
    call next_path(path)
    if (.not. allocated(path)) exit
    call read_one(path)
  end do

contains

  subroutine read_one(path)
    character(*), intent(in) :: path
    type(iges_request_t) :: request
    type(nurbs_surface_t), allocatable :: surfaces(:)
    type(string_t), allocatable :: report(:)
    type(fault_list_t) :: faults
    character(:), allocatable :: answer

    request%path = path
    request%origin = new_origin("fuzz.key", 1, "*TOOL")
    request%unit = "MM"
    allocate (request%numbers(0), request%labels(0))
    call read_iges(request, surfaces, report, faults)
    answer = merge("read   ", "refused", n_errors(faults) == 0)
    if (faults%n_items > 0) answer = answer//", "//faults%items(1)%expected
    call answer_with(answer)
  end subroutine read_one

end program fuzz_iges
