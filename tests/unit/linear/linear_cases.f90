!> Systems of equations for the tests of this layer.
module linear_cases
  use kinds, only: wp
  use failure, only: error_t
  use unknowns, only: tie_t, unknowns_t, new_unknowns
  use sparse_matrix, only: add_block, couplings_t, element_components, new_patch_grid, &
                           new_symmetric_matrix, patch_grid_t, set_zero, symmetric_matrix_t
  implicit none
  private

  public :: no_couplings, new_tie, noise, dense_pattern, set_dense, as_dense, two_patches
  public :: transformation, plate, product_with

contains

  !> Nothing but elements.
  function no_couplings() result(couplings)
    type(couplings_t) :: couplings

    couplings%first = [1]
    allocate (couplings%component(0))
  end function no_couplings

  subroutine new_tie(tie, component, leaders, coefficients)
    type(tie_t), intent(out) :: tie
    integer, intent(in) :: component, leaders(:)
    real(wp), intent(in) :: coefficients(:)

    tie%component = component
    tie%leaders = leaders
    tie%coefficients = coefficients
  end subroutine new_tie

  !> A symmetric matrix without any order, the same for the same seed.
  function noise(n, seed) result(matrix)
    integer, intent(in) :: n, seed
    real(wp) :: matrix(n, n)
    integer :: i, j

    do j = 1, n
      do i = j, n
        matrix(i, j) = 43758.5453_wp*sin(12.9898_wp*i + 78.233_wp*j + 37.719_wp*seed)
        matrix(i, j) = matrix(i, j) - anint(matrix(i, j))
        matrix(j, i) = matrix(i, j)
      end do
    end do
  end function noise

  !> A matrix of 3*n unknowns without zeros.
  subroutine dense_pattern(n, matrix)
    integer, intent(in) :: n
    type(symmetric_matrix_t), intent(out) :: matrix
    type(patch_grid_t) :: grids(1)
    type(unknowns_t) :: map
    type(tie_t) :: ties(0)
    type(error_t), allocatable :: error
    logical :: held(3*n)

    held = .false.
    call new_unknowns(held, ties, map, error)
    call new_patch_grid(grids(1), [n, 1, 1], [n, 1, 1], [1], [1], [1], 0)
    call new_symmetric_matrix(matrix, grids, map, no_couplings())
  end subroutine dense_pattern

  subroutine set_dense(matrix, values)
    type(symmetric_matrix_t), intent(inout) :: matrix
    real(wp), intent(in) :: values(:, :)
    integer :: k

    do k = 1, size(matrix%values)
      matrix%values(k) = values(matrix%rows(k), matrix%columns(k))
    end do
  end subroutine set_dense

  function as_dense(matrix) result(values)
    type(symmetric_matrix_t), intent(in) :: matrix
    real(wp) :: values(matrix%n, matrix%n)
    integer :: k

    values = 0.0_wp
    do k = 1, size(matrix%values)
      values(matrix%rows(k), matrix%columns(k)) = matrix%values(k)
      values(matrix%columns(k), matrix%rows(k)) = matrix%values(k)
    end do
  end function as_dense

  !> A patch of degrees 2, 3, 1 with a double knot along axis 1, and one of degrees 3, 2, 2.
  subroutine two_patches(grids, n_components)
    type(patch_grid_t), intent(out) :: grids(2)
    integer, intent(out) :: n_components

    call new_patch_grid(grids(1), [7, 5, 2], [3, 4, 2], [1, 2, 4, 5], [1, 2], [1], 0)
    call new_patch_grid(grids(2), [6, 4, 3], [4, 3, 3], [1, 2, 3], [1, 2], [1], 70)
    n_components = 3*(70 + 72)
  end subroutine two_patches

  !> T of the displacements d = T u.
  function transformation(map) result(t)
    type(unknowns_t), intent(in) :: map
    real(wp) :: t(map%n_components, map%n_free)
    integer :: c, k

    t = 0.0_wp
    do c = 1, map%n_components
      do k = map%first(c), map%first(c + 1) - 1
        t(c, map%unknown(k)) = map%coefficient(k)
      end do
    end do
  end function transformation

  !> A matrix with the entries of a plate of quadratic elements held along an edge, positive by the
  !! diagonal of each element.
  subroutine plate(n, matrix)
    integer, intent(in) :: n                   !! elements along each side
    type(symmetric_matrix_t), intent(out) :: matrix
    type(patch_grid_t) :: grids(1)
    type(unknowns_t) :: map
    type(tie_t) :: ties(0)
    type(error_t), allocatable :: error
    logical :: held(3*(n + 2)**2)
    real(wp) :: block(27, 27)
    integer :: first(n), i, j, m

    held = .false.
    held(:3*(n + 2)) = .true.
    call new_unknowns(held, ties, map, error)
    first = [(i, i=1, n)]
    call new_patch_grid(grids(1), [n + 2, n + 2, 1], [3, 3, 1], first, first, [1], 0)
    call new_symmetric_matrix(matrix, grids, map, no_couplings())
    call set_zero(matrix)
    do j = 1, n
      do i = 1, n
        block = noise(27, i + 7*j)
        do m = 1, 27
          block(m, m) = block(m, m) + 20.0_wp
        end do
        call add_block(matrix, map, element_components(grids(1), [i, j, 1]), block)
      end do
    end do
  end subroutine plate

  !> The matrix times a vector.
  function product_with(matrix, x) result(y)
    type(symmetric_matrix_t), intent(in) :: matrix
    real(wp), intent(in) :: x(:)
    real(wp) :: y(matrix%n)
    integer :: i, k

    y = 0.0_wp
    do i = 1, matrix%n
      do k = matrix%first(i), matrix%first(i + 1) - 1
        associate (j => matrix%columns(k))
          y(i) = y(i) + matrix%values(k)*x(j)
          if (j /= i) y(j) = y(j) + matrix%values(k)*x(i)
        end associate
      end do
    end do
  end function product_with

end module linear_cases
