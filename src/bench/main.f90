!> igaform_bench: what the solver's own routines cost, and what the machine can do at most.
program main
  use, intrinsic :: iso_c_binding, only: c_int
  use, intrinsic :: iso_fortran_env, only: error_unit, output_unit
  use c_library, only: c_exit
  use thread_waiting, only: shorten_waiting
  use command_options, only: program_arguments
  use bench_options, only: options_t, parse_options, usage_text
  use bench_run, only: run_benchmark, list_names, check_vectors
  implicit none

  type(options_t) :: options
  integer :: code

  call shorten_waiting()
  call parse_options(program_arguments(), options)
  code = 0
  if (options%reason /= "") then
    write (error_unit, "(a)") "igaform_bench: "//options%reason
    if (.not. options%is_judging) write (error_unit, "(a)") usage_text()
    code = 1
  else if (options%wants_help) then
    print "(a)", usage_text()
  else if (options%wants_list) then
    code = list_names(options)
  else if (options%wants_vectors) then
    code = check_vectors()
  else
    code = run_benchmark(options)
  end if
  flush (output_unit)
  ! STOP would print its code; the C library's exit does not.
  call c_exit(int(code, c_int))
end program main
