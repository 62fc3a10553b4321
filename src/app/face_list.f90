!> `igaform faces FILE`: the surfaces of an IGES file, to choose those of a tool among.
module face_list
  use, intrinsic :: iso_fortran_env, only: error_unit
  use input_errors, only: error_list_t, new_origin, n_errors
  use text, only: string_t
  use nurbs_surface, only: nurbs_surface_t
  use iges_selection, only: iges_request_t, new_request
  use cad_source, only: read_cad_file
  use error_report, only: report_errors
  use command_line, only: command_t
  use check_report, only: print_lines
  use exit_codes, only: exit_done, exit_input
  implicit none
  private

  public :: list_faces

contains

  !> Print what `igaform --check` prints of a tool of the whole file, in millimetres, whatever deck
  !! it is for, and which surfaces cannot be read; returns the exit code.
  integer function list_faces(command) result(code)
    type(command_t), intent(in) :: command
    type(iges_request_t) :: request
    type(nurbs_surface_t), allocatable :: surfaces(:)
    type(string_t), allocatable :: lines(:)
    type(error_list_t) :: errors

    request = new_request(command%deck, new_origin(command%deck, 0, "IGES"))
    request%is_listing = .true.
    call read_cad_file(request, surfaces, lines, errors)
    call report_errors(errors, error_unit)
    call print_lines(lines)
    code = merge(exit_done, exit_input, n_errors(errors) == 0)
  end function list_faces

end module face_list
