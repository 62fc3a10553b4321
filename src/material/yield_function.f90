!> Anisotropic yield functions in the axes of the material: equivalent stress and derivatives,
!! `lanes` points at a time. Yld2000 is that of `space_yield`.
!!
!! Hill48: R. Hill, Proc. R. Soc. A 193 (1948).  Yld91: F. Barlat, D. J. Lege and J. C. Brem, Int.
!! J. Plasticity 7 (1991).  Yld2004-18p: F. Barlat et al., Int. J. Plasticity 21 (2005), eq. (27).
!! Yld91 and Yld2004 share one form: the sum over i, j of |S'_i - S''_j|^m is 4 times the equivalent
!! stress to the power m, with the principal values of two linear transforms of the stress. For
!! Yld91 both are the same. Even m go without principal values, for Yld2004 up to `most_of_two`.
!! Axis 1 is the rolling direction, axis 3 the normal of the sheet.
!!
!! No pressure changes them: stresses come as deviators, see `deviator_lanes`.
module yield_function
  use kinds, only: wp
  use failure, only: error_t, fail
  use constant_check, only: check_finite, check_count, require
  use symmetric_eigen, only: principal_values
  use deviator_lanes, only: lanes
  use power_sums, only: most_of_two
  use invariant_yield, only: invariant_yield_t, transform_t, new_invariant_yield, &
                             evaluate_by_invariants, excess_by_invariants
  use principal_yield, only: principal_yield_t, evaluate_by_principal_values
  use plane_yield, only: plane_yield_t
  use sheet_functions, only: new_sheet_function, isotropic_shears
  use space_yield, only: space_yield_t, new_space_yield, evaluate_in_space, excess_in_space, &
                         bound_in_space
  implicit none
  private

  public :: new_yield_function, evaluate_yield, find_excess, mises_bound

  integer, parameter, public :: quadratic = 1, principal = 2, by_invariants = 3, by_squares = 4

  !> Of Hill's function: its square is the sum of the weights times the squares of modes, which are
  !! the shears and two combinations of the first two components.
  type, public :: quadratic_t
    real(wp) :: modes(2, 2) = 0.0_wp     !! perpendicular, as columns
    real(wp) :: weights(5) = 0.0_wp
    real(wp) :: block(2, 2) = 0.0_wp     !! of the first two components themselves
  end type quadratic_t

  !> A yield function; its equivalent stress grows in proportion to the stress.
  type, public :: yield_function_t
    integer :: kind = 0
    type(quadratic_t) :: hill
    type(principal_yield_t) :: values      !! of both other kinds
    type(invariant_yield_t) :: invariants
    type(space_yield_t) :: squares
  end type yield_function_t

  real(wp), parameter :: root2 = sqrt(2.0_wp), root6 = sqrt(6.0_wp)
  !> The first two components of a deviator as normal stresses.
  real(wp), parameter :: basis(3, 2) = reshape([1.0_wp/root2, -1.0_wp/root2, 0.0_wp, &
                                                1.0_wp/root6, 1.0_wp/root6, -2.0_wp/root6], [3, 2])

contains

  !> Yield function of this name: HILL48 (r_0, r_45, r_90), YLD91 (c_1 to c_6, m), YLD2000 (alpha_1
  !! to alpha_8, m) or YLD2004 (c'12 c'13 c'21 c'23 c'31 c'32 c'44 c'55 c'66, the same of c'', m).
  pure subroutine new_yield_function(name, constants, yield, error)
    character(*), intent(in) :: name
    real(wp), intent(in) :: constants(:)
    type(yield_function_t), intent(out) :: yield
    type(error_t), allocatable, intent(out) :: error
    character(len(name) + 19) :: owner
    type(plane_yield_t) :: plane

    call check_finite("constants of the yield function", constants, error)
    if (allocated(error)) return
    owner = "the yield function "//name
    select case (name)
    case ("HILL48")
      call check_count(owner, constants, 3, "three r-values", error)
      if (.not. allocated(error)) call set_hill48(constants, yield, error)
    case ("YLD91")
      call check_count(owner, constants, 7, "c1 to c6 and the exponent", error)
      if (allocated(error)) return
      yield%values%n_transforms = 1
      yield%values%transforms(:, :, 1) = yld91_transform(constants(:6))
      call set_exponent(constants(7), yield, error)
    case ("YLD2000")
      call new_sheet_function(name, constants, plane, error)
      if (allocated(error)) return
      yield%kind = by_squares
      yield%values%exponent = 2*plane%half
      yield%squares = new_space_yield(plane, isotropic_shears(plane%half))
    case ("YLD2004")
      call check_count(owner, constants, 19, "18 coefficients and the exponent", error)
      if (allocated(error)) return
      yield%values%n_transforms = 2
      yield%values%transforms(:, :, 1) = yld2004_transform(constants(:9))
      yield%values%transforms(:, :, 2) = yld2004_transform(constants(10:18))
      call set_exponent(constants(19), yield, error)
    case default
      call fail(error, "material: unknown yield function "//trim(name)// &
                ", known are HILL48, YLD91, YLD2000 and YLD2004, and in plane stress "// &
                "BARLAT89, BBC2003 and BBC2005")
    end select
  end subroutine new_yield_function

  !> G + H = 1: the flow stress is that of tension along the rolling direction. Shear through the
  !! thickness as in an isotropic sheet, L = M = 3/2.
  pure subroutine set_hill48(r, yield, error)
    real(wp), intent(in) :: r(3)   !! along 0, 45 and 90 degrees from rolling
    type(yield_function_t), intent(inout) :: yield
    type(error_t), allocatable, intent(inout) :: error
    real(wp) :: f, g, h, values(3), directions(3, 3)

    call require(all(r > 0.0_wp), "material: the r-values must be positive", error)
    if (allocated(error)) return
    yield%kind = quadratic
    g = 1.0_wp/(1.0_wp + r(1))
    h = r(1)*g
    f = h/r(3)
    associate (hill => yield%hill)
      hill%block = matmul(transpose(basis), &
                          matmul(reshape([g + h, -h, -g, -h, f + h, -f, -g, -f, f + g], [3, 3]), &
                                 basis))
      call principal_values([hill%block(1, 1), hill%block(2, 2), 0.0_wp, hill%block(1, 2), 0.0_wp, &
                             0.0_wp], values, directions)
      hill%modes = directions(:2, :2)
      hill%weights = [values(:2), 0.5_wp*(1.0_wp + 2.0_wp*r(2))*(f + g), 1.5_wp, 1.5_wp]
    end associate
  end subroutine set_hill48

  pure subroutine set_exponent(exponent, yield, error)
    real(wp), intent(in) :: exponent
    type(yield_function_t), intent(inout) :: yield
    type(error_t), allocatable, intent(inout) :: error
    integer, parameter :: largest = 100
    integer :: m, n

    yield%kind = principal
    yield%values%exponent = exponent
    call require(exponent >= 2.0_wp .and. exponent <= largest, &
                 "material: the exponent of the yield function must lie between 2 and 100", error)
    call require(any(abs(yield%values%transforms) > 0.0_wp), &
                 "material: the coefficients of the yield function are all zero", error)
    if (allocated(error) .or. abs(exponent - nint(exponent)) > 0.0_wp) return
    m = nint(exponent)
    n = yield%values%n_transforms
    yield%values%whole_exponent = m
    if (mod(m, 2) == 1 .or. (n == 2 .and. m > most_of_two)) return
    yield%kind = by_invariants
    yield%invariants = new_invariant_yield(m, parted(yield%values%transforms(:, :, :n)))
  end subroutine set_exponent

  !> Transforms parted into traces and what has none.
  pure function parted(matrices) result(transforms)
    real(wp), intent(in) :: matrices(:, :, :)   !! deviators to tensors
    type(transform_t) :: transforms(size(matrices, 3))
    integer :: k

    do k = 1, size(matrices, 3)
      associate (matrix => matrices(:, :, k))
        transforms(k)%block = matmul(transpose(basis), matrix(:3, :2))
        transforms(k)%factors = root2*[matrix(4, 3), matrix(5, 4), matrix(6, 5)]
        transforms(k)%mean = sum(matrix(:3, :2), 1)/3.0_wp
      end associate
    end do
  end function parted

  !> c1, c2, c3 weigh the differences 22-33, 33-11, 11-22; c4, c5, c6 the shears 23, 13, 12.
  pure function yld91_transform(c) result(transform)
    real(wp), intent(in) :: c(6)
    real(wp) :: transform(6, 5)

    transform = of_deviators(reshape([c(2) + c(3), -c(3), -c(2), -c(3), c(3) + c(1), -c(1), &
                                      -c(2), -c(1), c(1) + c(2)], [3, 3])/3.0_wp, c(6:4:-1))
  end function yld91_transform

  !> c12, c13, c21, c23, c31, c32 and, for the shears 23, 13, 12, c44, c55, c66, of the
  !! deviator.
  pure function yld2004_transform(c) result(transform)
    real(wp), intent(in) :: c(9)
    real(wp) :: transform(6, 5)

    transform = of_deviators(-reshape([0.0_wp, c(3), c(5), c(1), 0.0_wp, c(6), &
                                       c(2), c(4), 0.0_wp], [3, 3]), c(9:7:-1))
  end function yld2004_transform

  !> Transform of the normal stresses and factors on the shears 12, 13, 23, for a deviator.
  pure function of_deviators(normal, shears) result(transform)
    real(wp), intent(in) :: normal(3, 3), shears(3)
    real(wp) :: transform(6, 5)
    integer :: i

    transform = 0.0_wp
    transform(:3, :2) = matmul(normal, basis)
    do i = 1, 3
      transform(3 + i, 2 + i) = shears(i)/root2
    end do
  end function of_deviators

  !> A number that no equivalent stress over von Mises stress exceeds.
  pure real(wp) function mises_bound(yield)
    type(yield_function_t), intent(in) :: yield
    real(wp) :: size_of(2)
    integer :: k

    if (yield%kind == quadratic) then
      mises_bound = sqrt(2.0_wp/3.0_wp*maxval(yield%hill%weights))
      return
    else if (yield%kind == by_squares) then
      mises_bound = bound_in_space(yield%squares)
      return
    end if
    associate (values => yield%values)
      do k = 1, values%n_transforms
        associate (a => values%transforms(:, :, k))
          size_of(k) = max(sqrt(sum(a(:3, :2)**2)), root2*maxval(abs(a(4:, 3:))))
        end associate
      end do
      if (values%n_transforms == 1) size_of(2) = size_of(1)
      mises_bound = 2.25_wp**(1.0_wp/values%exponent)*sqrt(2.0_wp/3.0_wp)*sum(size_of)
    end associate
  end function mises_bound

  !> How far deviators lie outside of the yield surface: (q/flow)^m - 1 over m, with an m >= 1 for
  !! which it takes no root. It has the sign of q - flow and is not below q/flow - 1.
  pure subroutine find_excess(yield, stress, flow, excess)
    type(yield_function_t), intent(in) :: yield
    real(wp), intent(in) :: stress(lanes, 5), flow(lanes)   !! [stress]
    real(wp), intent(out) :: excess(lanes)
    real(wp) :: gradient(lanes, 5)
    integer :: l

    if (yield%kind == by_invariants) then
      call excess_by_invariants(yield%invariants, stress, flow, excess)
    else if (yield%kind == by_squares) then
      call excess_in_space(yield%squares, stress, flow, excess)
    else
      do l = 1, lanes
        if (yield%kind == principal) &
          call evaluate_by_principal_values(yield%values, stress(l, :), excess(l))
      end do
      if (yield%kind == quadratic) call evaluate_hill(yield%hill, stress, excess, gradient)
      excess = excess/flow - 1.0_wp
    end if
  end subroutine find_excess

  !> Equivalent stress of deviators, its gradient and its second derivatives, those packed:
  !! (i, j <= i) at i (i - 1)/2 + j.
  pure subroutine evaluate_yield(yield, stress, q, gradient, hessian)
    type(yield_function_t), intent(in) :: yield
    real(wp), intent(in) :: stress(lanes, 5)                 !! in the axes of the material
    real(wp), intent(out) :: q(lanes)                        !! [stress]
    real(wp), intent(out) :: gradient(lanes, 5)
    real(wp), intent(out), optional :: hessian(lanes, 15)    !! [1/stress]
    real(wp) :: slope(5), curvature(5, 5)
    integer :: i, l

    if (yield%kind == by_invariants) then
      call evaluate_by_invariants(yield%invariants, stress, q, gradient, hessian)
      return
    else if (yield%kind == quadratic) then
      call evaluate_hill(yield%hill, stress, q, gradient, hessian)
      return
    else if (yield%kind == by_squares) then
      call evaluate_in_space(yield%squares, stress, q, gradient, hessian)
      return
    end if
    do l = 1, lanes
      if (present(hessian)) then
        call evaluate_by_principal_values(yield%values, stress(l, :), q(l), slope, curvature)
        do i = 1, 5
          hessian(l, i*(i - 1)/2 + 1:i*(i + 1)/2) = curvature(:i, i)
        end do
      else
        call evaluate_by_principal_values(yield%values, stress(l, :), q(l), slope)
      end if
      gradient(l, :) = slope
    end do
  end subroutine evaluate_yield

  !> That of the quadratic function: P s/q and (P - (P s/q)(P s/q)^T)/q.
  pure subroutine evaluate_hill(hill, s, q, gradient, hessian)
    type(quadratic_t), intent(in) :: hill
    real(wp), intent(in) :: s(lanes, 5)
    real(wp), intent(out) :: q(lanes), gradient(lanes, 5)
    real(wp), intent(out), optional :: hessian(lanes, 15)
    real(wp) :: flow(lanes, 5)
    integer :: i, j, k

    flow(:, 1) = hill%block(1, 1)*s(:, 1) + hill%block(1, 2)*s(:, 2)
    flow(:, 2) = hill%block(2, 1)*s(:, 1) + hill%block(2, 2)*s(:, 2)
    do i = 3, 5
      flow(:, i) = hill%weights(i)*s(:, i)
    end do
    q = max(sqrt(max(s(:, 1)*flow(:, 1) + s(:, 2)*flow(:, 2) + s(:, 3)*flow(:, 3) &
                     + s(:, 4)*flow(:, 4) + s(:, 5)*flow(:, 5), 0.0_wp)), 1.0e-100_wp)
    do i = 1, 5
      gradient(:, i) = flow(:, i)/q
    end do
    if (.not. present(hessian)) return
    do i = 1, 5
      do j = 1, i
        k = i*(i - 1)/2 + j
        hessian(:, k) = -gradient(:, i)*gradient(:, j)
      end do
      if (i > 2) hessian(:, k) = hessian(:, k) + hill%weights(i)
    end do
    hessian(:, 1) = hessian(:, 1) + hill%block(1, 1)
    hessian(:, 2) = hessian(:, 2) + hill%block(2, 1)
    hessian(:, 3) = hessian(:, 3) + hill%block(2, 2)
    do k = 1, 15
      hessian(:, k) = hessian(:, k)/q
    end do
  end subroutine evaluate_hill

end module yield_function
