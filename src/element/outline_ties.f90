!> Control points at the edge of an outline that follow others inside it.
!!
!! A control point whose functions reach inside the outline only through slivers has next to no mass
!! and stiffness of its own: the time increment of bending would fall with the square of the sliver,
!! and equations would lose their digits. Such a control point follows those of the nearest element
!! with enough inside: its motion is that of their polynomial, continued (K. Hoellig, U. Reif and
!! J. Wipper, Weighted extended B-spline approximation of Dirichlet problems, SIAM J. Numer. Anal.
!! 39 (2001) 442-462), exact for polynomials of the degree on any knots. So do those just outside,
!! which the normals of a shell's faces near the edge ask for. Others outside stay as they are.
module outline_ties
  use kinds, only: wp
  use knot_vector, only: knot_vector_t
  implicit none
  private

  public :: new_outline_ties, lead_points, collect_forces, give_mass

  !> Followers of one patch; n = 0: none. Points along axis 3 follow those of their own layer.
  type, public :: outline_ties_t
    integer :: n = 0
    integer, allocatable :: follower(:, :)          !! control indices, (2, n)
    integer, allocatable :: leader(:, :)            !! first control point of the element, (2, n)
    real(wp), allocatable :: coefficient1(:, :)     !! by its points along axis 1, (p1 + 1, n)
    real(wp), allocatable :: coefficient2(:, :)     !! and axis 2
    logical, allocatable :: is_free(:, :)           !! control points that move for themselves
    logical, allocatable :: is_idle(:, :)           !! those that nothing moves
    real(wp), allocatable :: share(:, :)            !! of each element that is inside
    integer :: farthest = 0                         !! elements between an element with something
                                                    !! inside and that which leads its points
    integer :: lonely(2) = 0                        !! the element that is so far from its leader
  end type outline_ties_t

contains

  !> Control points of elements with at least `least` of their area inside are free.
  pure subroutine new_outline_ties(axes, first1, first2, share, least, ties)
    type(knot_vector_t), intent(in) :: axes(2)
    integer, intent(in) :: first1(:), first2(:)     !! first control point of each element
    real(wp), intent(in) :: share(:, :)             !! of the elements that is inside
    real(wp), intent(in) :: least
    type(outline_ties_t), intent(out) :: ties
    logical, allocatable :: is_near(:, :)
    integer :: n(2), p(2), i, j, e(2)

    n = axes%n_basis
    p = axes%degree
    ties%share = share
    allocate (ties%is_free(n(1), n(2)), is_near(n(1), n(2)), source=.false.)
    do j = 1, size(first2)
      do i = 1, size(first1)
        if (share(i, j) <= 0.0_wp) cycle
        ! The normals of faces take the neighbours of a control point, and these its own.
        is_near(max(1, first1(i) - p(1) - 1):min(n(1), first1(i) + 2*p(1) + 1), &
                max(1, first2(j) - p(2) - 1):min(n(2), first2(j) + 2*p(2) + 1)) = .true.
        if (share(i, j) < least) cycle
        ties%is_free(first1(i):first1(i) + p(1), first2(j):first2(j) + p(2)) = .true.
      end do
    end do
    ties%is_idle = .not. (is_near .or. ties%is_free)
    ties%n = count(is_near .and. .not. ties%is_free)
    allocate (ties%follower(2, ties%n), ties%leader(2, ties%n))
    allocate (ties%coefficient1(p(1) + 1, ties%n), ties%coefficient2(p(2) + 1, ties%n))
    ties%n = 0
    do j = 1, n(2)
      do i = 1, n(1)
        if (ties%is_free(i, j) .or. ties%is_idle(i, j)) cycle
        ties%n = ties%n + 1
        e = nearest_element([i, j], first1, first2, p, share, least)
        ties%follower(:, ties%n) = [i, j]
        ties%leader(:, ties%n) = [first1(e(1)), first2(e(2))]
        ties%coefficient1(:, ties%n) = continued(axes(1), first1(e(1)), i)
        ties%coefficient2(:, ties%n) = continued(axes(2), first2(e(2)), j)
      end do
    end do
    do j = 1, size(first2)
      do i = 1, size(first1)
        if (share(i, j) <= 0.0_wp .or. share(i, j) >= least) cycle
        e = nearest_element([first1(i), first2(j)] + p/2, first1, first2, p, share, least)
        if (maxval(abs(e - [i, j])) <= ties%farthest) cycle
        ties%farthest = maxval(abs(e - [i, j]))
        ties%lonely = [i, j]
      end do
    end do
  end subroutine new_outline_ties

  !> The element nearest to a control point among those with at least `least` inside, by numbers
  !! along both axes. Of several, one straight along an axis: what is held at an edge of the sheet
  !! then follows what is held there; of these the one with the most inside, which is the stiffest.
  pure function nearest_element(at, first1, first2, p, share, least) result(element)
    integer, intent(in) :: at(2), first1(:), first2(:), p(2)
    real(wp), intent(in) :: share(:, :), least
    integer :: element(2), i, j, away(2), distance, best

    element = 1
    best = huge(1)
    do j = 1, size(first2)
      do i = 1, size(first1)
        if (share(i, j) < least) cycle
        away(1) = max(first1(i) - at(1), at(1) - first1(i) - p(1), 0)
        away(2) = max(first2(j) - at(2), at(2) - first2(j) - p(2), 0)
        distance = sum(away**2)
        if (distance > best) cycle
        if (distance == best) then
          if (share(i, j) <= share(element(1), element(2))) cycle
        end if
        best = distance
        element = [i, j]
      end do
    end do
  end function nearest_element

  !> Coefficients of the control points of an element whose polynomial has the control point i: its
  !! polar form at the knots of i (L. Ramshaw, Blossoms are polar forms, CAGD 6 (1989) 323-358).
  pure function continued(axis, first, i) result(coefficients)
    type(knot_vector_t), intent(in) :: axis
    integer, intent(in) :: first, i                 !! first control point of the element
    real(wp) :: coefficients(axis%degree + 1), table(axis%degree + 1, axis%degree + 1), t
    integer :: p, r, k, s

    p = axis%degree
    s = first + p                                   ! the knot at which the element begins
    table = 0.0_wp
    do k = 1, p + 1
      table(k, k) = 1.0_wp
    end do
    if (i >= first .and. i <= first + p) then       ! itself, without round-off
      coefficients = table(:, i - first + 1)
      return
    end if
    do r = 1, p
      t = axis%knots(i + r)
      do k = p + 1, r + 1, -1
        associate (low => axis%knots(s - p + k - 1), high => axis%knots(s + k - r))
          table(:, k) = ((high - t)*table(:, k - 1) + (t - low)*table(:, k))/(high - low)
        end associate
      end do
    end do
    coefficients = table(:, p + 1)
  end function continued

  !> Give the followers the field that their leaders have, such as velocities.
  pure subroutine lead_points(ties, field)
    type(outline_ties_t), intent(in) :: ties
    real(wp), intent(inout) :: field(:, :, :, :)    !! shape (n1, n2, n3, components)
    real(wp) :: value
    integer :: t, k, c, i, j

    do c = 1, size(field, 4)
      do k = 1, size(field, 3)
        do t = 1, ties%n
          value = 0.0_wp
          do j = 1, size(ties%coefficient2, 1)
            do i = 1, size(ties%coefficient1, 1)
              value = value + ties%coefficient1(i, t)*ties%coefficient2(j, t) &
                      *field(ties%leader(1, t) + i - 1, ties%leader(2, t) + j - 1, k, c)
            end do
          end do
          field(ties%follower(1, t), ties%follower(2, t), k, c) = value
        end do
      end do
    end do
  end subroutine lead_points

  !> Forces on followers go to their leaders: the transposed of `lead_points`.
  pure subroutine collect_forces(ties, field)
    type(outline_ties_t), intent(in) :: ties
    real(wp), intent(inout) :: field(:, :, :, :)
    integer :: t, k, c, i, j

    do c = 1, size(field, 4)
      do k = 1, size(field, 3)
        do t = 1, ties%n
          associate (own => field(ties%follower(1, t), ties%follower(2, t), k, c))
            do j = 1, size(ties%coefficient2, 1)
              do i = 1, size(ties%coefficient1, 1)
                associate (f => field(ties%leader(1, t) + i - 1, ties%leader(2, t) + j - 1, k, c))
                  f = f + ties%coefficient1(i, t)*ties%coefficient2(j, t)*own
                end associate
              end do
            end do
            own = 0.0_wp
          end associate
        end do
      end do
    end do
  end subroutine collect_forces

  !> The mass of a follower goes to the nearest control point of the element that leads it, whole,
  !! so that all masses stay positive.
  pure subroutine give_mass(ties, mass)
    type(outline_ties_t), intent(in) :: ties
    real(wp), intent(inout) :: mass(:, :, :)
    integer :: t, at(2), p(2)

    p = [size(ties%coefficient1, 1), size(ties%coefficient2, 1)] - 1
    do t = 1, ties%n
      at = min(max(ties%follower(:, t), ties%leader(:, t)), ties%leader(:, t) + p)
      associate (own => ties%follower(:, t))
        mass(at(1), at(2), :) = mass(at(1), at(2), :) + mass(own(1), own(2), :)
        mass(own(1), own(2), :) = 0.0_wp
      end associate
    end do
  end subroutine give_mass

end module outline_ties
