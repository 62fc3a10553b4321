!> What each of several processes does with the command line.
module mpi_program
  use, intrinsic :: iso_fortran_env, only: error_unit, output_unit
  use interrupt, only: hold_saves, watch_saves
  use thread_waiting, only: shorten_waiting
  use command_line, only: command_t, read_command_line, usage_text, version_text
  use exit_codes, only: exit_done, exit_input
  use out_of_memory, only: watch_memory, leave
  use deck_run, only: run_deck
  use ranks, only: is_first
  use mpi_ranks, only: mpi_ranks_t, begin_mpi, end_mpi
  implicit none
  private

  public :: run_program

contains

  !> The whole program; it does not come back.
  subroutine run_program(ranks)
    class(mpi_ranks_t), intent(inout) :: ranks     !! not begun
    type(command_t) :: command
    integer :: code

    call hold_saves()
    call shorten_waiting()   ! which may begin the program anew, so before MPI
    call watch_memory()
    call watch_saves()
    call begin_mpi(ranks)
    call read_command_line(command)
    code = exit_done
    if (command%reason == "" .and. (command%is_batch .or. command%is_faces .or. &
                                    command%is_material .or. command%is_iges .or. &
                                    command%wants_keywords)) &
      command%reason = "igaform-mpi runs decks; what you ask for is up to igaform"
    if (command%reason /= "") then
      if (is_first(ranks)) then
        write (error_unit, "(a)") "igaform: "//command%reason
        write (error_unit, "(a)") usage_text()
      end if
      code = exit_input
    else if (command%wants_help) then
      if (is_first(ranks)) print "(a)", usage_text()
    else if (command%wants_version) then
      if (is_first(ranks)) print "(a)", version_text()
    else
      code = run_deck(command, ranks)
    end if
    flush (output_unit)
    flush (error_unit)
    call end_mpi()
    call leave(code)
  end subroutine run_program

end module mpi_program
