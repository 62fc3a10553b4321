!> Yld2000-2d in space, in the axes of the material: equivalent stress and derivatives of deviators,
!! `lanes` points at a time.
!!
!! The squares Q of `plane_yield` take the stresses 11 and 22 less that through the sheet, and the
!! shears through it as in an isotropic sheet (M. Dunand, A. P. Maertens, M. Luo and D. Mohr, Int.
!! J. Plasticity 36 (2012) with alpha_9 to alpha_12 = 1). The equivalent stress to the power m = 2k
!! is e(Q1, Q2) + Q3^k.
module space_yield
  use kinds, only: wp
  use deviator_lanes, only: lanes
  use plane_yield, only: plane_yield_t, mises_bound_in_plane, second_derivatives
  use row_functions, only: power_row, inverse_root
  implicit none
  private

  public :: new_space_yield, evaluate_in_space, excess_in_space, bound_in_space

  !> A yield function of this kind.
  type, public :: space_yield_t
    type(plane_yield_t) :: plane           !! of the first two components and the largest shear
    real(wp) :: shear(3, 3) = 0.0_wp       !! factors of the squares of the components 3 to 5 in Q
  end type space_yield_t

  !> Squares, derivatives of the power by them, and gradients of them.
  type :: squares_t
    real(wp), dimension(lanes) :: u, v, w, fu, fv, fw, uu, uv, vv, ww, power
    real(wp), dimension(lanes, 5) :: du, dv, dw
  end type squares_t

  real(wp), parameter :: root2 = sqrt(2.0_wp), root6 = sqrt(6.0_wp)
  real(wp), parameter :: least = 1.0e-60_wp    ! power of the stress, so that derivatives without
                                               ! stress are numbers

contains

  !> From the function in plane stress without a second pair, and its squares of the shear 12 for
  !! what bears all shears alike.
  pure function new_space_yield(plane, isotropic) result(yield)
    type(plane_yield_t), intent(in) :: plane
    real(wp), intent(in) :: isotropic(3)
    type(space_yield_t) :: yield
    !> Stresses 11 and 22 less 33 from the first two components.
    real(wp), parameter :: into(2, 2) = 0.5_wp*reshape([root2, -root2, root6, root6], [2, 2])

    yield%plane = plane
    yield%plane%normal = matmul(transpose(into), plane%normal)
    yield%shear(1, :) = 0.5_wp*plane%shear(:3)
    yield%shear(2, :) = 0.5_wp*isotropic
    yield%shear(3, :) = 0.5_wp*isotropic
    yield%plane%shear(:3) = maxval(yield%shear, 1)
  end function new_space_yield

  !> A number that no equivalent stress over von Mises stress exceeds.
  pure real(wp) function bound_in_space(yield)
    type(space_yield_t), intent(in) :: yield

    bound_in_space = sqrt(2.0_wp/3.0_wp)*mises_bound_in_plane(yield%plane)
  end function bound_in_space

  !> (q/flow)^m - 1 over m.
  pure subroutine excess_in_space(yield, stress, flow, excess)
    type(space_yield_t), intent(in) :: yield
    real(wp), intent(in) :: stress(lanes, 5), flow(lanes)
    real(wp), intent(out) :: excess(lanes)
    real(wp), parameter :: next_to_none = 1.0e-8_wp   ! flow stress over stress, as in
                                                      ! `excess_by_invariants`
    real(wp) :: inverse(lanes)
    type(squares_t) :: squares

    inverse = 1.0_wp/max(flow, next_to_none*length_of(stress))
    call find_squares(yield, inverse, stress, squares)
    excess = (squares%power - 1.0_wp)/(2*yield%plane%half)
  end subroutine excess_in_space

  !> Equivalent stress of deviators, its gradient and its second derivatives, packed.
  pure subroutine evaluate_in_space(yield, stress, q, gradient, hessian)
    type(space_yield_t), intent(in) :: yield
    real(wp), intent(in) :: stress(lanes, 5)
    real(wp), intent(out) :: q(lanes), gradient(lanes, 5)     !! [stress], none
    real(wp), intent(out), optional :: hessian(lanes, 15)     !! [1/stress]
    real(wp), dimension(lanes) :: length, inverse, root, first, square
    type(squares_t) :: squares
    integer :: i, l, m

    m = 2*yield%plane%half
    length = length_of(stress)
    inverse = 1.0_wp/length
    call find_squares(yield, inverse, stress, squares)
    root = max(squares%power, least)
    q = root
    if (m == 6 .or. m == 8) then
      call inverse_root(lanes, m, q, root)
    else
      call power_row(lanes, -1.0_wp/m, root)
    end if
    !$omp simd
    do l = 1, lanes
      first(l) = 1.0_wp/(root(l)*q(l))
      q(l) = first(l)*q(l)
      first(l) = first(l)/m
      square(l) = (m - 1)*inverse(l)*root(l)
    end do
    do i = 1, 5
      !$omp simd
      do l = 1, lanes
        gradient(l, i) = first(l)*(squares%fu(l)*squares%du(l, i) + squares%fv(l)*squares%dv(l, i) &
                                   + squares%fw(l)*squares%dw(l, i))
      end do
    end do
    if (present(hessian)) call set_hessian(yield, first*inverse, square, gradient, squares, hessian)
    q = length*q
  end subroutine evaluate_in_space

  pure function length_of(s) result(length)
    real(wp), intent(in) :: s(lanes, 5)
    real(wp) :: length(lanes)
    real(wp), parameter :: shortest = 1.0e-100_wp

    length = max(sqrt(s(:, 1)**2 + s(:, 2)**2 + s(:, 3)**2 + s(:, 4)**2 + s(:, 5)**2), shortest)
  end function length_of

  !> All of `squares_t` for the stress over a scaling. Slopes and value follow from the second
  !! derivatives by Euler's theorem.
  pure subroutine find_squares(yield, inverse, stress, squares)
    type(space_yield_t), intent(in) :: yield
    real(wp), intent(in) :: inverse(lanes), stress(lanes, 5)
    type(squares_t), intent(out) :: squares
    real(wp) :: per, flat, k
    integer :: j, l

    k = yield%plane%half
    per = 1.0_wp/max(yield%plane%half - 1, 1)
    flat = merge(1.0_wp, 0.0_wp, yield%plane%half == 1)
    call square_of(yield, 1, inverse, stress, squares%u, squares%du)
    call square_of(yield, 2, inverse, stress, squares%v, squares%dv)
    call square_of(yield, 3, inverse, stress, squares%w, squares%dw)
    call second_derivatives(yield%plane, squares%u, squares%v, squares%uu, squares%uv, squares%vv)
    squares%ww = k*(k - 1.0_wp)
    do j = 1, yield%plane%half - 2
      squares%ww = squares%ww*squares%w
    end do
    !$omp simd
    do l = 1, lanes
      squares%fu(l) = flat + per*(squares%u(l)*squares%uu(l) + squares%v(l)*squares%uv(l))
      squares%fv(l) = flat + per*(squares%u(l)*squares%uv(l) + squares%v(l)*squares%vv(l))
      squares%fw(l) = flat + per*squares%w(l)*squares%ww(l)
      squares%power(l) = (squares%u(l)*squares%fu(l) + squares%v(l)*squares%fv(l) &
                          + squares%w(l)*squares%fw(l))/k
    end do
  end subroutine find_squares

  !> One of the squares and its gradient.
  pure subroutine square_of(yield, number, inverse, stress, square, gradient)
    type(space_yield_t), intent(in) :: yield
    integer, intent(in) :: number
    real(wp), intent(in) :: inverse(lanes), stress(lanes, 5)
    real(wp), intent(out) :: square(lanes), gradient(lanes, 5)
    real(wp) :: x
    integer :: i, l

    associate (n => yield%plane%normal(:, number), t => yield%shear(:, number))
      !$omp simd private(x)
      do l = 1, lanes
        x = inverse(l)*(n(1)*stress(l, 1) + n(2)*stress(l, 2))
        square(l) = x*x
        gradient(l, 1) = 2.0_wp*n(1)*x
        gradient(l, 2) = 2.0_wp*n(2)*x
      end do
      do i = 3, 5
        !$omp simd private(x)
        do l = 1, lanes
          x = inverse(l)*stress(l, i)
          square(l) = square(l) + t(i - 2)*x*x
          gradient(l, i) = 2.0_wp*t(i - 2)*x
        end do
      end do
    end associate
  end subroutine square_of

  !> From the second derivatives by the squares.
  pure subroutine set_hessian(yield, first, square, gradient, squares, hessian)
    type(space_yield_t), intent(in) :: yield
    real(wp), intent(in) :: first(lanes), square(lanes)   !! factors: of those of the power, of the
                                                          !! products of the gradient
    real(wp), intent(in) :: gradient(lanes, 5)
    type(squares_t), intent(in) :: squares
    real(wp), intent(out) :: hessian(lanes, 15)
    real(wp), dimension(lanes) :: a, b, c
    real(wp) :: bends(3)
    integer :: i, j, l

    do i = 1, 5
      !$omp simd
      do l = 1, lanes
        a(l) = first(l)*(squares%uu(l)*squares%du(l, i) + squares%uv(l)*squares%dv(l, i))
        b(l) = first(l)*(squares%uv(l)*squares%du(l, i) + squares%vv(l)*squares%dv(l, i))
        c(l) = first(l)*squares%ww(l)*squares%dw(l, i)
      end do
      do j = 1, i
        bends = bends_of(yield, i, j)
        associate (h => hessian(:, i*(i - 1)/2 + j))
          !$omp simd
          do l = 1, lanes
            h(l) = a(l)*squares%du(l, j) + b(l)*squares%dv(l, j) + c(l)*squares%dw(l, j) &
                   - square(l)*gradient(l, i)*gradient(l, j) &
                   + first(l)*(bends(1)*squares%fu(l) + bends(2)*squares%fv(l) &
                               + bends(3)*squares%fw(l))
          end do
        end associate
      end do
    end do
  end subroutine set_hessian

  !> Second derivatives of the squares.
  pure function bends_of(yield, i, j) result(bends)
    type(space_yield_t), intent(in) :: yield
    integer, intent(in) :: i, j
    real(wp) :: bends(3)

    bends = 0.0_wp
    if (max(i, j) <= 2) then
      bends = 2.0_wp*yield%plane%normal(i, :3)*yield%plane%normal(j, :3)
    else if (i == j) then
      bends = 2.0_wp*yield%shear(i - 2, :)
    end if
  end function bends_of

end module space_yield
