!> Reads IGES files as lists and decks do, path by path from the standard input, for fuzz.py.
program fuzz_iges
  use input_errors, only: error_list_t, new_origin, n_errors
  use text, only: string_t
  use nurbs_surface, only: nurbs_surface_t
  use iges_selection, only: iges_request_t, new_request
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
    type(error_list_t) :: errors
    character(:), allocatable :: answer

    request = new_request(path, new_origin("fuzz.key", 1, "*TOOL"))
    request%is_listing = .true.
    call read_iges(request, surfaces, report, errors)
    request%is_listing = .false.
    errors = error_list_t()
    call read_iges(request, surfaces, report, errors)
    answer = merge("read   ", "refused", n_errors(errors) == 0)
    if (errors%n_items > 0) answer = answer//", "//errors%items(1)%expected
    call answer_with(answer)
  end subroutine read_one

end program fuzz_iges
