!> igaform: explicit isogeometric analysis of sheet-metal forming, from a keyword deck.
program main
  use, intrinsic :: iso_fortran_env, only: error_unit, output_unit
  use interrupt, only: hold_saves, watch_saves
  use thread_waiting, only: shorten_waiting
  use command_line, only: command_t, read_command_line, usage_text, version_text
  use keyword_manual, only: keyword_manual_text
  use batch, only: run_batch
  use exit_codes, only: exit_done, exit_input
  use out_of_memory, only: watch_memory, leave
  use deck_run, only: run_deck
  use material_run, only: run_material_tests
  use face_list, only: list_faces
  implicit none

  type(command_t) :: command
  integer :: code

  call hold_saves()        ! a wish to save that comes early waits
  call shorten_waiting()   ! which may begin the program anew, and leaves what waits
  call watch_memory()
  call watch_saves()
  call read_command_line(command)
  code = exit_done
  if (command%is_iges) then
    write (error_unit, "(a)") "igaform: IGES files are written by 'python -m post iges FILE', "// &
      "with the same options"
    code = exit_input
  else if (command%reason /= "") then
    write (error_unit, "(a)") "igaform: "//command%reason
    write (error_unit, "(a)") usage_text()
    code = exit_input
  else if (command%wants_help) then
    print "(a)", usage_text()
  else if (command%wants_version) then
    print "(a)", version_text()
  else if (command%wants_keywords) then
    write (output_unit, "(a)", advance="no") keyword_manual_text()
  else if (command%is_batch) then
    code = run_batch(command)
  else if (command%is_faces) then
    code = list_faces(command)
  else if (command%is_material) then
    code = run_material_tests(command)
  else
    code = run_deck(command)
  end if
  flush (output_unit)
  flush (error_unit)
  call leave(code)
end program main
