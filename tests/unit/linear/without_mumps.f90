!> Asks for factors where there is no MUMPS, and prints the answer.
program without_mumps
  use failure, only: error_t
  use sparse_factor, only: sparse_factor_t
  use sparse_matrix, only: symmetric_matrix_t
  use linear_cases, only: dense_pattern
  implicit none
  type(sparse_factor_t) :: factor
  type(symmetric_matrix_t) :: matrix
  type(error_t), allocatable :: error

  call dense_pattern(1, matrix)
  call factor%analyse(matrix, error)
  if (allocated(error)) print "(a)", error%message
end program without_mumps
