!> Factors of a stiffness: a plate of quadratic solids, one layer, held along an edge. The time is
!! that of the entries, so the values are simple ones.
module factor_case
  use kinds, only: wp
  use failure, only: error_t
  use bench_case, only: bench_case_t
  use unknowns, only: new_unknowns, tie_t, unknowns_t
  use sparse_matrix, only: add_block, couplings_t, element_components, new_patch_grid, &
                           new_symmetric_matrix, patch_grid_t, symmetric_matrix_t
  use sparse_factor, only: sparse_factor_t
  implicit none
  private

  type, extends(bench_case_t), public :: factor_case_t
    integer :: n_elements = 0            !! along each edge
    logical :: is_assembly = .false.     !! the matrix is what is timed
    type(unknowns_t) :: map
    type(patch_grid_t) :: grid
    type(symmetric_matrix_t) :: matrix
    type(sparse_factor_t) :: factor
    type(error_t), allocatable :: failed
  contains
    procedure :: prepare
    procedure :: run
    procedure :: check
  end type factor_case_t

  integer, parameter :: n_components = 81   ! of an element

contains

  !> The matrix and its analysis.
  subroutine prepare(self, error)
    class(factor_case_t), intent(inout) :: self
    type(error_t), allocatable, intent(out) :: error
    type(couplings_t) :: none
    type(tie_t) :: ties(0)
    logical, allocatable :: held(:)
    integer :: first(self%n_elements), n, i

    n = self%n_elements + 2
    first = [(i, i=1, size(first))]
    held = [(mod((i - 1)/3, n) == 0, i=1, 9*n**2)]
    none%first = [1]
    allocate (none%component(0))
    call new_unknowns(held, ties, self%map, error)
    if (allocated(error)) return
    call new_patch_grid(self%grid, [n, n, 3], [3, 3, 3], first, first, [1], 0)
    call new_symmetric_matrix(self%matrix, [self%grid], self%map, none)
    call add_elements(self)
    self%n_units = self%matrix%n
    if (self%is_assembly) return
    call self%factor%analyse(self%matrix, error)
    self%flops = self%factor%n_operations/self%n_units
    self%working_set = 8.0_wp*self%factor%n_entries
  end subroutine prepare

  !> Blocks that are positive by their diagonal.
  subroutine add_elements(self)
    class(factor_case_t), intent(inout) :: self
    real(wp) :: block(n_components, n_components)
    integer :: i, j

    block = -1.0_wp
    do i = 1, n_components
      block(i, i) = n_components
    end do
    do j = 1, self%n_elements
      do i = 1, self%n_elements
        call add_block(self%matrix, self%map, element_components(self%grid, [i, j, 1]), block)
      end do
    end do
  end subroutine add_elements

  subroutine run(self)
    class(factor_case_t), intent(inout) :: self

    if (self%is_assembly) then
      call add_elements(self)
    else
      call self%factor%factorise(self%matrix, self%failed)
    end if
  end subroutine run

  subroutine check(self, error)
    class(factor_case_t), intent(in) :: self
    type(error_t), allocatable, intent(out) :: error

    if (allocated(self%failed)) error = self%failed
  end subroutine check

end module factor_case
