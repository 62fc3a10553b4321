!> Anisotropic yield functions in the axes of the material: equivalent stress and derivatives.
!!
!! Hill48: R. Hill, Proc. R. Soc. A 193 (1948).  Yld91: F. Barlat, D. J. Lege and J. C. Brem, Int.
!! J. Plasticity 7 (1991).  Yld2004-18p: F. Barlat et al., Int. J. Plasticity 21 (2005), eq. (27).
!! The last two share one form: the sum over i, j of |S'_i - S''_j|^m is 4 times the equivalent
!! stress to the power m, with the principal values of two linear transforms of the stress. For
!! Yld91 both are the same, and even m go without principal values. Axis 1 is the rolling
!! direction, axis 3 the normal of the sheet.
!!
!! Hershey's function of even exponent by the invariants of the stress, without principal values:
!! The sum of the powers m = 2k of the differences of principal values (A. V. Hershey, J. Appl.
!! Mech. 21 (1954)) is the power sum p_k of their squares x. Those are the roots of
!! x^3 - 6 J2 x^2 + 9 J2^2 x - (4 J2^3 - 27 J3^2), the last coefficient being the discriminant, and
!! from -ln(1 - 6 x + 9 x^2 - 4 u x^3) comes, with u = 1 - 27 J3^2/(4 J2^3) between 0 and 1,
!!
!!   p_k = 2 (3 J2)^k P(u),  P(u) = 1 + sum over j of k/(2j) (4/27)^j binomial(k-j-1, 2j-1) u^j.
!!
!! All terms are positive, and P is smooth where principal values coincide.
module yield_function
  use kinds, only: wp
  use failure, only: error_t, fail
  use constant_check, only: check_finite, check_count, require
  use symmetric_eigen, only: principal_values
  implicit none
  private

  public :: new_yield_function, evaluate_yield, mises_bound

  integer, parameter, public :: quadratic = 1, principal = 2, by_invariants = 3

  !> A yield function; its equivalent stress grows in proportion to the stress.
  type, public :: yield_function_t
    integer :: kind = 0
    integer :: n_transforms = 0              !! of the principal kind, 1 or 2
    real(wp) :: transforms(6, 6, 2) = 0.0_wp !! quadratic: the matrix P of s.P.s in place 1
    real(wp) :: exponent = 2.0_wp            !! m
    integer :: whole_exponent = 0            !! m as integer, 0 if it is none
    real(wp), allocatable :: series(:)       !! by invariants: of `hershey_series`
    real(wp) :: modes(3, 2) = 0.0_wp         !! quadratic: of the normal stresses of a deviator
    real(wp) :: weights(5) = 0.0_wp          !! of their squares and of those of the shears
  end type yield_function_t

  !> Principal values of one transform and the matrix that takes a stress increment to its
  !! components 11, 22, 33, 12, 13, 23 in their axes.
  type :: frame_t
    real(wp) :: values(3), matrix(6, 6)
  end type frame_t

contains

  !> Yield function of this name: HILL48 (r_0, r_45, r_90), YLD91 (c_1 to c_6, m) or YLD2004
  !! (c'12 c'13 c'21 c'23 c'31 c'32 c'44 c'55 c'66, the same of c'', m).
  pure subroutine new_yield_function(name, constants, yield, error)
    character(*), intent(in) :: name
    real(wp), intent(in) :: constants(:)
    type(yield_function_t), intent(out) :: yield
    type(error_t), allocatable, intent(out) :: error
    character(len(name) + 19) :: owner

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
      yield%n_transforms = 1
      yield%transforms(:, :, 1) = yld91_transform(constants(:6))
      call set_exponent(constants(7), yield, error)
    case ("YLD2004")
      call check_count(owner, constants, 19, "18 coefficients and the exponent", error)
      if (allocated(error)) return
      yield%n_transforms = 2
      yield%transforms(:, :, 1) = yld2004_transform(constants(:9))
      yield%transforms(:, :, 2) = yld2004_transform(constants(10:18))
      call set_exponent(constants(19), yield, error)
    case default
      call fail(error, "material: unknown yield function "//trim(name)// &
                ", known are HILL48, YLD91 and YLD2004")
    end select
  end subroutine new_yield_function

  !> G + H = 1: the flow stress is that of tension along the rolling direction. Shear through the
  !! thickness as in an isotropic sheet, L = M = 3/2.
  pure subroutine set_hill48(r, yield, error)
    real(wp), intent(in) :: r(3)   !! along 0, 45 and 90 degrees from rolling
    type(yield_function_t), intent(inout) :: yield
    type(error_t), allocatable, intent(inout) :: error
    real(wp) :: f, g, h

    call require(all(r > 0.0_wp), "material: the r-values must be positive", error)
    if (allocated(error)) return
    yield%kind = quadratic
    g = 1.0_wp/(1.0_wp + r(1))
    h = r(1)*g
    f = h/r(3)
    yield%transforms(:3, :3, 1) = reshape([g + h, -h, -g, -h, f + h, -f, -g, -f, f + g], [3, 3])
    yield%transforms(4, 4, 1) = (1.0_wp + 2.0_wp*r(2))*(f + g)
    yield%transforms(5, 5, 1) = 3.0_wp
    yield%transforms(6, 6, 1) = 3.0_wp
    yield%weights(3:) = [yield%transforms(4, 4, 1), 3.0_wp, 3.0_wp]
    call find_modes(yield)
  end subroutine set_hill48

  !> Perpendicular modes of the normal stresses of a deviator in which the quadratic form is a sum
  !! of squares.
  pure subroutine find_modes(yield)
    type(yield_function_t), intent(inout) :: yield
    real(wp) :: values(3), directions(3, 3), basis(3, 2), form(2, 2)
    integer :: i

    basis(:, 1) = [1.0_wp, -1.0_wp, 0.0_wp]/sqrt(2.0_wp)
    basis(:, 2) = [1.0_wp, 1.0_wp, -2.0_wp]/sqrt(6.0_wp)
    form = matmul(transpose(basis), matmul(yield%transforms(:3, :3, 1), basis))
    call principal_values([form(1, 1), form(2, 2), 0.0_wp, form(1, 2), 0.0_wp, 0.0_wp], values, &
                          directions)
    do i = 1, 2
      yield%modes(:, i) = matmul(basis, directions(:2, i))
      yield%weights(i) = values(i)
    end do
  end subroutine find_modes

  pure subroutine set_exponent(exponent, yield, error)
    real(wp), intent(in) :: exponent
    type(yield_function_t), intent(inout) :: yield
    type(error_t), allocatable, intent(inout) :: error
    integer, parameter :: largest = 100

    yield%kind = principal
    yield%exponent = exponent
    call require(exponent >= 2.0_wp .and. exponent <= largest, &
                 "material: the exponent of the yield function must lie between 2 and 100", error)
    call require(any(abs(yield%transforms) > 0.0_wp), &
                 "material: the coefficients of the yield function are all zero", error)
    if (allocated(error) .or. abs(exponent - nint(exponent)) > 0.0_wp) return
    yield%whole_exponent = nint(exponent)
    if (yield%n_transforms == 2 .or. mod(yield%whole_exponent, 2) == 1) return
    yield%kind = by_invariants
    yield%series = hershey_series(yield%whole_exponent)
  end subroutine set_exponent

  !> c1, c2, c3 weigh the differences 22-33, 33-11, 11-22; c4, c5, c6 the shears 23, 13, 12.
  pure function yld91_transform(c) result(transform)
    real(wp), intent(in) :: c(6)
    real(wp) :: transform(6, 6)

    transform = 0.0_wp
    transform(:3, :3) = reshape([c(2) + c(3), -c(3), -c(2), -c(3), c(3) + c(1), -c(1), &
                                 -c(2), -c(1), c(1) + c(2)], [3, 3])/3.0_wp
    transform(4, 4) = c(6)
    transform(5, 5) = c(5)
    transform(6, 6) = c(4)
  end function yld91_transform

  !> c12, c13, c21, c23, c31, c32 and, for the shears 23, 13, 12, c44, c55, c66, of the
  !! deviator.
  pure function yld2004_transform(c) result(transform)
    real(wp), intent(in) :: c(9)
    real(wp) :: transform(6, 6)
    real(wp) :: deviator(3, 3)
    integer :: i

    deviator = -1.0_wp/3.0_wp
    do i = 1, 3
      deviator(i, i) = 2.0_wp/3.0_wp
    end do
    transform = 0.0_wp
    transform(:3, :3) = -matmul(reshape([0.0_wp, c(3), c(5), c(1), 0.0_wp, c(6), c(2), c(4), &
                                         0.0_wp], [3, 3]), deviator)
    transform(4, 4) = c(9)
    transform(5, 5) = c(8)
    transform(6, 6) = c(7)
  end function yld2004_transform

  !> A number that no equivalent stress over von Mises stress exceeds.
  pure real(wp) function mises_bound(yield)
    type(yield_function_t), intent(in) :: yield
    real(wp) :: size_of(2)
    integer :: k

    size_of = 0.0_wp
    do k = 1, 2
      associate (a => yield%transforms(:, :, k))
        size_of(k) = max(sqrt(sum(a(:3, :3)**2)), abs(a(4, 4)), abs(a(5, 5)), abs(a(6, 6)))
      end associate
    end do
    if (yield%n_transforms == 1) size_of(2) = size_of(1)
    if (yield%kind == quadratic) then
      mises_bound = sqrt(2.0_wp/3.0_wp*size_of(1))
    else
      mises_bound = 2.25_wp**(1.0_wp/yield%exponent)*sqrt(2.0_wp/3.0_wp)*sum(size_of)
    end if
  end function mises_bound

  !> Equivalent stress, its gradient (with respect to a shear stress that stands for both of its
  !! entries, so that the flow is engineering strain) and its second derivatives.
  pure subroutine evaluate_yield(yield, stress, q, gradient, hessian)
    type(yield_function_t), intent(in) :: yield
    real(wp), intent(in) :: stress(6)              !! in the axes of the material
    real(wp), intent(out) :: q                     !! [stress]
    real(wp), intent(out), optional :: gradient(6)
    real(wp), intent(out), optional :: hessian(6, 6)   !! only with the gradient [1/stress]
    real(wp) :: flow(6)
    integer :: i

    if (yield%kind == by_invariants) then
      call evaluate_by_invariants(yield, stress, q, gradient, hessian)
      return
    else if (yield%kind == principal) then
      call evaluate_principal(yield, stress, q, gradient, hessian)
      return
    end if
    associate (p => yield%transforms(:, :, 1))
      flow = matmul(p, stress)
      q = sqrt(max(dot_product(stress, flow), 0.0_wp))
      flow = flow/max(q, tiny(q))
      if (present(gradient)) gradient = flow
      if (present(hessian)) then
        do i = 1, 6
          hessian(:, i) = (p(:, i) - flow*flow(i))/max(q, tiny(q))
        end do
      end if
    end associate
  end subroutine evaluate_yield

  !> Hershey's function of the transformed stress, and the way back to the stress itself.
  pure subroutine evaluate_by_invariants(yield, stress, q, gradient, hessian)
    type(yield_function_t), intent(in) :: yield
    real(wp), intent(in) :: stress(6)
    real(wp), intent(out) :: q
    real(wp), intent(out), optional :: gradient(6), hessian(6, 6)
    real(wp) :: s(6), slope(6), curvature(6, 6), half(6, 3)
    integer :: i

    associate (a => yield%transforms(:, :, 1))
      do i = 1, 3
        s(i) = a(i, 1)*stress(1) + a(i, 2)*stress(2) + a(i, 3)*stress(3)
        s(i + 3) = a(i + 3, i + 3)*stress(i + 3)
      end do
      if (.not. present(gradient)) then
        call evaluate_hershey(yield%whole_exponent, yield%series, s, q)
        return
      else if (present(hessian)) then
        call evaluate_hershey(yield%whole_exponent, yield%series, s, q, slope, curvature)
      else
        call evaluate_hershey(yield%whole_exponent, yield%series, s, q, slope)
      end if
      do i = 1, 3
        gradient(i) = a(1, i)*slope(1) + a(2, i)*slope(2) + a(3, i)*slope(3)
        gradient(i + 3) = a(i + 3, i + 3)*slope(i + 3)
      end do
      if (.not. present(hessian)) return
      do i = 1, 3
        half(:, i) = curvature(:, 1)*a(1, i) + curvature(:, 2)*a(2, i) + curvature(:, 3)*a(3, i)
        curvature(:, i + 3) = curvature(:, i + 3)*a(i + 3, i + 3)
      end do
      do i = 1, 3
        hessian(i, :3) = a(1, i)*half(1, :) + a(2, i)*half(2, :) + a(3, i)*half(3, :)
        hessian(i + 3, :3) = a(i + 3, i + 3)*half(i + 3, :)
        hessian(i + 3, 4:) = a(i + 3, i + 3)*curvature(i + 3, 4:)
      end do
      hessian(:3, 4:) = transpose(hessian(4:, :3))
    end associate
  end subroutine evaluate_by_invariants

  !> The functions of principal values.
  pure subroutine evaluate_principal(yield, stress, q, gradient, hessian)
    type(yield_function_t), intent(in) :: yield
    real(wp), intent(in) :: stress(6)
    real(wp), intent(out) :: q
    real(wp), intent(out), optional :: gradient(6), hessian(6, 6)
    type(frame_t) :: frames(2)
    real(wp) :: slopes(3, 2), difference(3, 3), largest
    integer :: i, j, k

    do k = 1, yield%n_transforms
      call new_frame(yield%transforms(:, :, k), stress, present(gradient), frames(k))
    end do
    if (yield%n_transforms == 1) frames(2) = frames(1)
    do j = 1, 3
      difference(:, j) = frames(1)%values - frames(2)%values(j)
    end do
    largest = max(maxval(abs(difference)), tiny(largest))
    q = largest*(0.25_wp*sum(power(yield, 0, abs(difference)/largest))) &
        **(1.0_wp/yield%exponent)
    if (.not. present(gradient)) return
    difference = difference/q
    slopes(:, 1) = 0.25_wp*sum(power(yield, 2, abs(difference))*difference, 2)
    slopes(:, 2) = -0.25_wp*sum(power(yield, 2, abs(difference))*difference, 1)
    gradient = 0.0_wp
    do k = 1, 2
      do i = 1, 3
        gradient = gradient + slopes(i, k)*frames(k)%matrix(i, :)
      end do
    end do
    if (present(hessian)) call second_derivatives(yield, q, frames, slopes, &
                                                  power(yield, 2, abs(difference)), hessian)
  end subroutine evaluate_principal

  !> Principal values of a transform of the stress, and its matrix if it is asked for.
  pure subroutine new_frame(transform, stress, with_matrix, frame)
    real(wp), intent(in) :: transform(6, 6), stress(6)
    logical, intent(in) :: with_matrix
    type(frame_t), intent(out) :: frame
    integer, parameter :: one(6) = [1, 2, 3, 1, 1, 2], two(6) = [1, 2, 3, 2, 3, 3]
    real(wp) :: axes(3, 3), row(6)
    integer :: i

    call principal_values([matmul(transform(:3, :3), stress(:3)), transform(4, 4)*stress(4), &
                           transform(5, 5)*stress(5), transform(6, 6)*stress(6)], &
                          frame%values, axes)
    if (.not. with_matrix) return
    do i = 1, 6
      associate (a => axes(:, one(i)), b => axes(:, two(i)))
        row(:3) = a*b
        row(4:) = [a(1)*b(2) + a(2)*b(1), a(1)*b(3) + a(3)*b(1), a(2)*b(3) + a(3)*b(2)]
        frame%matrix(i, :3) = matmul(row(:3), transform(:3, :3))
        frame%matrix(i, 4:) = row(4:)*[transform(4, 4), transform(5, 5), transform(6, 6)]
      end associate
    end do
  end subroutine new_frame

  !> x to the power m - `less`.
  elemental real(wp) function power(yield, less, x)
    type(yield_function_t), intent(in) :: yield
    integer, intent(in) :: less
    real(wp), intent(in) :: x   !! >= 0

    if (yield%whole_exponent > 0) then
      power = x**(yield%whole_exponent - less)
    else
      power = x**(yield%exponent - less)
    end if
  end function power

  !> From the derivatives by principal values to those by stress: the values themselves, and
  !! the rotation of their axes with (slope_a - slope_b)/(value_a - value_b), which for equal
  !! values has a limit.
  pure subroutine second_derivatives(yield, q, frames, slopes, powers, hessian)
    type(yield_function_t), intent(in) :: yield
    real(wp), intent(in) :: q, slopes(3, 2), powers(3, 3)   !! powers: to m - 2, of differences/q
    type(frame_t), intent(in) :: frames(2)
    real(wp), intent(out) :: hessian(6, 6)
    real(wp), parameter :: near = 1.0e-7_wp
    real(wp) :: by_values(6, 6), slope(6), stacked(6, 6), turn, scaling
    integer :: i, j, k, place

    scaling = (yield%exponent - 1.0_wp)/q
    slope = [slopes(:, 1), slopes(:, 2)]
    by_values = 0.0_wp
    by_values(:3, 4:) = -0.25_wp*scaling*powers
    by_values(4:, :3) = transpose(by_values(:3, 4:))
    do i = 1, 3
      by_values(i, i) = 0.25_wp*scaling*sum(powers(i, :))
      by_values(i + 3, i + 3) = 0.25_wp*scaling*sum(powers(:, i))
    end do
    do j = 1, 6
      by_values(:, j) = by_values(:, j) - scaling*slope*slope(j)
    end do
    stacked(:3, :) = frames(1)%matrix(:3, :)
    stacked(4:, :) = frames(2)%matrix(:3, :)
    hessian = matmul(transpose(stacked), matmul(by_values, stacked))
    if (yield%n_transforms == 1) then
      by_values(:3, :3) = by_values(:3, :3) + by_values(:3, 4:) + by_values(4:, :3) &
                          + by_values(4:, 4:)
      slope(:3) = slope(:3) + slope(4:)
    end if
    do k = 1, yield%n_transforms
      do place = 4, 6
        i = merge(1, 2, place < 6)
        j = merge(2, 3, place == 4)
        associate (values => frames(k)%values, at => 3*(k - 1))
          if (abs(values(i) - values(j)) > near*q) then
            turn = (slope(at + i) - slope(at + j))/(values(i) - values(j))
          else
            turn = 0.5_wp*(by_values(at + i, at + i) + by_values(at + j, at + j)) &
                   - by_values(at + i, at + j)
          end if
        end associate
        hessian = hessian + 2.0_wp*turn*spread(frames(k)%matrix(place, :), 1, 6) &
                  *spread(frames(k)%matrix(place, :), 2, 6)
      end do
    end do
  end subroutine second_derivatives

  !> Coefficients of P from the power 1 on.
  pure function hershey_series(exponent) result(series)
    integer, intent(in) :: exponent              !! m, even
    real(wp) :: series(exponent/6)
    real(wp) :: binomial
    integer :: i, j, k

    k = exponent/2
    do j = 1, size(series)
      binomial = 1.0_wp
      do i = 1, 2*j - 1
        binomial = binomial*(k - 3*j + i)/i
      end do
      series(j) = real(k, wp)/(2*j)*(4.0_wp/27.0_wp)**j*binomial
    end do
  end function hershey_series

  !> Equivalent stress sqrt(3 J2) P^(1/m) of a deviator, and its derivatives, in which a shear
  !! stands for both of its entries.
  pure subroutine evaluate_hershey(exponent, series, s, q, gradient, hessian)
    integer, intent(in) :: exponent
    real(wp), intent(in) :: series(:)            !! of `hershey_series`
    real(wp), intent(in) :: s(6)                 !! 11 22 33 12 13 23
    real(wp), intent(out) :: q                   !! [stress]
    real(wp), intent(out), optional :: gradient(6), hessian(6, 6)   !! second with the first
    real(wp), parameter :: root3 = sqrt(3.0_wp)
    real(wp) :: n(6), t(6), length, w, g(0:2)

    length = sqrt(max(0.5_wp*(s(1)**2 + s(2)**2 + s(3)**2) + s(4)**2 + s(5)**2 + s(6)**2, &
                      tiny(length)))
    n = s/length
    w = n(1)*n(2)*n(3) + 2.0_wp*n(4)*n(5)*n(6) - n(1)*n(6)**2 - n(2)*n(5)**2 - n(3)*n(4)**2
    call shape_factor(exponent, series, w, g)
    q = root3*length*g(0)
    if (.not. present(gradient)) return
    ! n^2 - 2/3 I - 3/2 w n, by which w changes.
    t = [n(1)**2 + n(4)**2 + n(5)**2 - 2.0_wp/3.0_wp, n(4)**2 + n(2)**2 + n(6)**2 - 2.0_wp/3.0_wp, &
         n(5)**2 + n(6)**2 + n(3)**2 - 2.0_wp/3.0_wp, n(1)*n(4) + n(4)*n(2) + n(5)*n(6), &
         n(1)*n(5) + n(4)*n(6) + n(5)*n(3), n(4)*n(5) + n(2)*n(6) + n(6)*n(3)] - 1.5_wp*w*n
    n(4:) = 2.0_wp*n(4:)
    t(4:) = 2.0_wp*t(4:)
    gradient = root3*(0.5_wp*g(0)*n + g(1)*t)
    if (present(hessian)) call hershey_second_derivatives(root3/length, w, g, n, t, hessian)
  end subroutine evaluate_hershey

  !> P^(1/m) and its derivatives by w = J3/J2^(3/2).
  pure subroutine shape_factor(exponent, series, w, g)
    integer, intent(in) :: exponent
    real(wp), intent(in) :: series(:), w
    real(wp), intent(out) :: g(0:2)
    real(wp) :: u, p, p1, p2, u1
    integer :: j

    u = 1.0_wp - 6.75_wp*w*w
    u1 = -13.5_wp*w
    p = 0.0_wp
    p1 = 0.0_wp
    p2 = 0.0_wp
    do j = size(series), 1, -1
      p2 = p2*u + 2.0_wp*p1
      p1 = p1*u + p
      p = p*u + series(j)
    end do
    ! One more step for the leading 1.
    p2 = p2*u + 2.0_wp*p1
    p1 = (p1*u + p)
    p = 1.0_wp + p*u
    p1 = p1/(exponent*p)
    p2 = p2/(exponent*p) - exponent*p1*p1
    g(0) = p**(1.0_wp/exponent)
    g(1) = g(0)*p1*u1
    g(2) = g(0)*((p1*u1)**2 + p2*u1*u1 - 13.5_wp*p1)
  end subroutine shape_factor

  !> Derivatives of the gradient by a deviator; what a pressure would add is omitted.
  pure subroutine hershey_second_derivatives(factor, w, g, n, t, hessian)
    real(wp), intent(in) :: factor         !! sqrt(3/J2) [1/stress]
    real(wp), intent(in) :: w, g(0:2)
    real(wp), intent(in) :: n(6), t(6)     !! shears doubled
    real(wp), intent(out) :: hessian(6, 6)
    integer, parameter :: rows(9) = [1, 2, 1, 3, 2, 3, 4, 4, 5]
    integer, parameter :: columns(9) = [4, 4, 5, 5, 6, 6, 5, 6, 6]
    integer, parameter :: parts(9) = [4, 4, 5, 5, 6, 6, 6, 5, 4]
    real(wp) :: whole, of_n, twice
    integer :: i, j, k

    whole = 0.5_wp*g(0) - 1.5_wp*w*g(1)
    of_n = 0.25_wp*g(0) + 0.75_wp*w*g(1)
    do i = 1, 6
      hessian(:, i) = (g(2)*t(i) - g(1)*n(i))*t - (of_n*n(i) + g(1)*t(i))*n
    end do
    ! The form 2 tr(n X X).
    twice = 2.0_wp*g(1)
    do i = 1, 3
      hessian(i, i) = hessian(i, i) + whole + twice*n(i)
      hessian(i + 3, i + 3) = hessian(i + 3, i + 3) + 2.0_wp*whole
    end do
    hessian(4, 4) = hessian(4, 4) + twice*(n(1) + n(2))
    hessian(5, 5) = hessian(5, 5) + twice*(n(1) + n(3))
    hessian(6, 6) = hessian(6, 6) + twice*(n(2) + n(3))
    do k = 1, size(rows)
      i = rows(k)
      j = columns(k)
      hessian(i, j) = hessian(i, j) + g(1)*n(parts(k))
      hessian(j, i) = hessian(i, j)
    end do
    hessian = factor*hessian
  end subroutine hershey_second_derivatives

end module yield_function
