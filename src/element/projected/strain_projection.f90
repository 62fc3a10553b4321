!> Projection of strains against locking: what is projected and by which operators.
!!
!! The operator of a direction is the least-squares fit of an element's values by a polynomial,
!! weighted by the quadrature weights (P. Lancaster and K. Salkauskas, Math. Comp. 37 (1981); for
!! strains R. P. R. Cardoso and J. M. A. Cesar de Sa, IJNME 97 (2014)); that of an element is the
!! product of those of its directions. At the p + 1 Gauss points of full quadrature a fit with p
!! terms is the value at the p Gauss points of the reduced rule, carried to all points: the
!! Legendre polynomial of degree p, which the fit leaves out, has its zeros there. Smooth
!! projections couple the elements of a row.
module strain_projection
  use kinds, only: wp
  use failure, only: error_t, fail
  use text, only: counted
  use basis_tables, only: axis_table_t
  use knot_vector, only: knot_vector_t
  use linear_algebra, only: solve
  use smooth_splines, only: smooth_axis_t, new_smooth_axis
  implicit none
  private

  public :: new_projection, default_samples, project_along, projection_name

  integer, parameter, public :: project_nothing = 0
  integer, parameter, public :: project_volume = 1   !! BBAR: the volume strain
  integer, parameter, public :: project_sheet = 2    !! ANS: also transverse shear

  !> What a deck asks for.
  type, public :: projection_spec_t
    integer :: kind = project_nothing
    integer :: n_samples(3) = 0       !! per element and direction, 0: default
    logical :: is_smooth = .false.    !! onto the splines of the patch of one degree less; BBAR
  end type projection_spec_t

  !> Operator of one direction; none where the samples are as many as the points.
  type, public :: axis_operator_t
    logical :: is_identity = .true.
    real(wp), allocatable :: matrix(:, :)       !! shape (n_points, n_points)
    real(wp), allocatable :: transposed(:, :)
  end type axis_operator_t

  !> Projection of a patch.
  type, public :: projection_t
    integer :: kind = project_nothing
    integer :: n_samples(3) = 0
    logical :: is_smooth = .false.
    type(axis_operator_t) :: axes(3)     !! of an element
    type(smooth_axis_t) :: smooth(3)     !! of the patch, instead
  end type projection_t

contains

  !> Projection for the quadrature of a patch.
  subroutine new_projection(projection, spec, knots, axes, error)
    type(projection_t), intent(out) :: projection
    type(projection_spec_t), intent(in) :: spec
    type(knot_vector_t), intent(in) :: knots(3)
    type(axis_table_t), intent(in) :: axes(3)
    type(error_t), allocatable, intent(out) :: error
    integer :: axis

    projection%kind = spec%kind
    if (spec%kind == project_nothing) return
    projection%is_smooth = spec%is_smooth
    projection%n_samples = spec%n_samples
    where (spec%n_samples == 0) projection%n_samples = default_samples(axes%degree, axes%n_points)
    do axis = 1, 3
      if (spec%is_smooth) then
        call new_smooth_axis(projection%smooth(axis), knots(axis), axes(axis), error)
      else
        call set_operator(projection%axes(axis), axes(axis), projection%n_samples(axis), error)
      end if
      if (allocated(error)) return
    end do
  end subroutine new_projection

  !> Samples in one direction where the deck names none.
  elemental integer function default_samples(degree, n_points) result(n_samples)
    integer, intent(in) :: degree, n_points   !! of the element in this direction

    n_samples = min(degree, n_points)
  end function default_samples

  !> Name of a kind of projection as decks have it.
  pure function projection_name(kind) result(name)
    integer, intent(in) :: kind
    character(:), allocatable :: name

    select case (kind)
    case (project_volume)
      name = "BBAR"
    case (project_sheet)
      name = "ANS"
    case default
      name = "NONE"
    end select
  end function projection_name

  !> The fit of the values at the points of an axis by a polynomial of `n_samples` terms.
  subroutine set_operator(operator, axis, n_samples, error)
    type(axis_operator_t), intent(out) :: operator
    type(axis_table_t), intent(in) :: axis
    integer, intent(in) :: n_samples
    type(error_t), allocatable, intent(out) :: error
    real(wp) :: basis(n_samples, axis%n_points), weighted(n_samples, axis%n_points)
    real(wp) :: factors(n_samples)
    integer :: i, k
    logical :: is_solved

    operator%is_identity = n_samples == axis%n_points
    if (operator%is_identity) return
    if (n_samples > axis%n_points) then
      call fail(error, "projection: "//counted(n_samples, "sample")//" in a direction with "// &
                counted(axis%n_points, "quadrature point"))
      return
    end if
    do k = 1, n_samples
      basis(k, :) = axis%abscissae**(k - 1)
      weighted(k, :) = axis%weights*basis(k, :)
    end do
    allocate (operator%matrix(axis%n_points, axis%n_points))
    do i = 1, axis%n_points
      factors = basis(:, i)
      call solve(matmul(weighted, transpose(basis)), factors, is_solved)
      if (.not. is_solved) then
        call fail(error, "projection: these points do not carry a fit of this degree")
        return
      end if
      operator%matrix(i, :) = matmul(factors, weighted)
    end do
    operator%transposed = transpose(operator%matrix)
  end subroutine set_operator

  !> Project fields of the points of one block along the axes asked for, in place.
  pure subroutine project_along(projection, is_along, is_transposed, q, n_fields, field)
    type(projection_t), intent(in) :: projection
    logical, intent(in) :: is_along(3)
    logical, intent(in) :: is_transposed        !! for forces
    integer, intent(in) :: q(3), n_fields
    real(wp), intent(inout) :: field(8*q(3)*n_fields*q(2)*q(1))   !! (8, q3, n_fields, q2, q1)
    integer :: axis, before, after

    do axis = 1, 3
      if (projection%axes(axis)%is_identity .or. .not. is_along(axis)) cycle
      select case (axis)
      case (1)
        before = 8*q(3)*n_fields*q(2)
        after = 1
      case (2)
        before = 8*q(3)*n_fields
        after = q(1)
      case default
        before = 8
        after = n_fields*q(2)*q(1)
      end select
      associate (operator => projection%axes(axis))
        if (is_transposed) then
          call multiply(before, q(axis), after, operator%transposed, field)
        else
          call multiply(before, q(axis), after, operator%matrix, field)
        end if
      end associate
    end do
  end subroutine project_along

  pure subroutine multiply(before, q, after, matrix, field)
    integer, intent(in) :: before, q, after
    real(wp), intent(in) :: matrix(q, q)
    real(wp), intent(inout) :: field(before, q, after)
    real(wp) :: old(before, q)
    integer :: m, i, j, k

    do k = 1, after
      old = field(:, :, k)
      do i = 1, q
        !$omp simd
        do m = 1, before
          field(m, i, k) = matrix(i, 1)*old(m, 1)
        end do
        do j = 2, q
          !$omp simd
          do m = 1, before
            field(m, i, k) = field(m, i, k) + matrix(i, j)*old(m, j)
          end do
        end do
      end do
    end do
  end subroutine multiply

end module strain_projection
