!> igaform-mpi: the run of a deck by all processes that `mpirun` starts.
program mpi_main
  use mpi_ranks, only: mpi_ranks_t
  use mpi_program, only: run_program
  implicit none

  type(mpi_ranks_t) :: ranks

  call run_program(ranks)
end program mpi_main
