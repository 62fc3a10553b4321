!> Control points at the edge of an outline that follow others inside it.
!!
!! A control point whose functions reach inside the outline only through slivers has next to no mass
!! and stiffness of its own: the time increment of bending would fall with the square of the sliver,
!! and equations would lose their digits. Such a control point follows those of the nearest element
!! with enough inside: its motion is that of their polynomial, continued (K. Hoellig, U. Reif and
!! J. Wipper, Weighted extended B-spline approximation of Dirichlet problems, SIAM J. Numer. Anal.
!! 39 (2001) 442-462), exact for polynomials of the degree on any knots. Of several elements that
!! are equal it follows the mean, so that mirror images stay mirror images. So do control points
!! just outside, which the normals of a shell's faces near the edge ask for. Others outside stay as
!! they are.
module outline_ties
  use kinds, only: wp
  use knot_vector, only: knot_vector_t
  implicit none
  private

  public :: new_outline_ties, lead_points, collect_forces, give_mass

  !> A control point, and those whose motion it follows. Points along axis 3 follow those of their
  !! own layer.
  type :: follower_t
    integer :: at(2) = 0                            !! its control indices
    integer, allocatable :: leader(:, :)            !! those of free control points, (2, any)
    real(wp), allocatable :: coefficient(:)         !! of the motion of each
    real(wp), allocatable :: mass_share(:)          !! part of the follower's mass that each takes
  end type follower_t

  !> Followers of one patch; n = 0: none.
  type, public :: outline_ties_t
    integer :: n = 0
    type(follower_t), allocatable :: followers(:)
    logical, allocatable :: is_free(:, :)           !! control points that move for themselves
    logical, allocatable :: is_idle(:, :)           !! those that nothing moves
    real(wp), allocatable :: share(:, :)            !! of each element that is inside
    integer :: farthest = 0                         !! elements from one with something inside to
                                                    !! the nearest that leads
    integer :: lonely(2) = 0                        !! the element that is so far from its leader
  end type outline_ties_t

  !> Shares that differ by less, of themselves, are equal: curves lie in place but for round-off.
  real(wp), parameter :: alike = 1.0e-6_wp

contains

  !> Control points of elements with at least `least` of their area inside are free. Where there is
  !! no such element nothing follows.
  pure subroutine new_outline_ties(axes, first1, first2, share, least, ties)
    type(knot_vector_t), intent(in) :: axes(2)
    integer, intent(in) :: first1(:), first2(:)     !! first control point of each element
    real(wp), intent(in) :: share(:, :)             !! of the elements that is inside
    real(wp), intent(in) :: least
    type(outline_ties_t), intent(out) :: ties
    logical, allocatable :: is_near(:, :), leads(:, :)
    integer, allocatable :: nearest(:, :)
    integer :: n(2), p(2), i, j

    n = axes%n_basis
    p = axes%degree
    ties%share = share
    leads = share >= (1.0_wp - alike)*least
    allocate (ties%is_free(n(1), n(2)), is_near(n(1), n(2)), source=.false.)
    do j = 1, size(first2)
      do i = 1, size(first1)
        if (share(i, j) <= 0.0_wp) cycle
        ! The normals of faces take the neighbours of a control point, and these its own.
        is_near(max(1, first1(i) - p(1) - 1):min(n(1), first1(i) + 2*p(1) + 1), &
                max(1, first2(j) - p(2) - 1):min(n(2), first2(j) + 2*p(2) + 1)) = .true.
        if (.not. leads(i, j)) cycle
        ties%is_free(first1(i):first1(i) + p(1), first2(j):first2(j) + p(2)) = .true.
      end do
    end do
    ties%is_idle = .not. (is_near .or. ties%is_free)
    allocate (ties%followers(count(is_near .and. .not. ties%is_free)))
    if (.not. any(leads)) return
    do j = 1, n(2)
      do i = 1, n(1)
        if (ties%is_free(i, j) .or. ties%is_idle(i, j)) cycle
        ties%n = ties%n + 1
        call find_nearest([i, j], first1, first2, p, share, leads, nearest)
        call follow(axes, first1, first2, nearest, [i, j], ties%followers(ties%n))
      end do
    end do
    call find_farthest(leads, ties)
  end subroutine new_outline_ties

  !> Where a mask of a box is true, in the order of its elements.
  pure function places_of(mask, low) result(places)
    logical, intent(in) :: mask(:, :)
    integer, intent(in) :: low(2)                   !! of the box
    integer, allocatable :: places(:, :)            !! shape (2, any)
    integer :: k, l

    places = reshape([pack(spread([(k, k=1, size(mask, 1))], 2, size(mask, 2)), mask), &
                      pack(spread([(l, l=1, size(mask, 2))], 1, size(mask, 1)), mask)], &
                     [2, count(mask)], order=[2, 1])
    places = places + spread(low - 1, 2, size(places, 2))
  end function places_of

  !> How far an element with something inside is from the nearest that leads, by the larger of the
  !! numbers of elements along both axes.
  pure subroutine find_farthest(leads, ties)
    logical, intent(in) :: leads(:, :)
    type(outline_ties_t), intent(inout) :: ties
    integer :: i, j, away

    do j = 1, size(leads, 2)
      do i = 1, size(leads, 1)
        if (ties%share(i, j) <= 0.0_wp .or. leads(i, j)) cycle
        away = 1
        do while (.not. any(leads(max(1, i - away):min(size(leads, 1), i + away), &
                                  max(1, j - away):min(size(leads, 2), j + away))))
          away = away + 1
        end do
        if (away <= ties%farthest) cycle
        ties%farthest = away
        ties%lonely = [i, j]
      end do
    end do
  end subroutine find_farthest

  !> The elements nearest to a control point among those that lead, by numbers along both axes. Of
  !! several, those straight along an axis: what is held at an edge of the sheet then follows what
  !! is held there; of these the ones with the most inside, which are the stiffest.
  pure subroutine find_nearest(at, first1, first2, p, share, leads, nearest)
    integer, intent(in) :: at(2), first1(:), first2(:), p(2)
    real(wp), intent(in) :: share(:, :)
    logical, intent(in) :: leads(:, :)
    integer, allocatable, intent(out) :: nearest(:, :)   !! shape (2, any); empty where none leads
    integer, allocatable :: away(:, :)
    logical, allocatable :: is_nearest(:, :)
    integer :: away1(size(first1)), away2(size(first2)), low(2), high(2), around

    away1 = max(first1 - at(1), at(1) - first1 - p(1), 0)
    away2 = max(first2 - at(2), at(2) - first2 - p(2), 0)
    around = 0
    do         ! Elements beyond a box are farther away than it reaches.
      low = [findloc(away1 <= around, .true., 1), findloc(away2 <= around, .true., 1)]
      high = [findloc(away1 <= around, .true., 1, back=.true.), &
              findloc(away2 <= around, .true., 1, back=.true.)]
      low = max(low, 1)
      is_nearest = leads(low(1):high(1), low(2):high(2))
      away = spread(away1(low(1):high(1))**2, 2, size(is_nearest, 2)) &
             + spread(away2(low(2):high(2))**2, 1, size(is_nearest, 1))
      if (minval(away, is_nearest) <= around**2 .or. all(shape(is_nearest) == shape(leads))) exit
      around = around + 1
    end do
    is_nearest = is_nearest .and. away == minval(away, is_nearest)
    associate (own => share(low(1):high(1), low(2):high(2)))
      is_nearest = is_nearest .and. own >= (1.0_wp - alike)*maxval(own, is_nearest)
    end associate
    nearest = places_of(is_nearest, low)
  end subroutine find_nearest

  !> The mean of the polynomials of some elements, at a control point. Its mass goes to the nearest
  !! control point of each of these, whole, so that all masses stay positive.
  pure subroutine follow(axes, first1, first2, followed, at, follower)
    type(knot_vector_t), intent(in) :: axes(2)
    integer, intent(in) :: first1(:), first2(:)     !! first control point of each element
    integer, intent(in) :: followed(:, :)           !! elements, shape (2, any)
    integer, intent(in) :: at(2)
    type(follower_t), intent(out) :: follower
    real(wp), allocatable :: coefficient(:, :), mass_share(:, :)   ! of the box of the elements
    integer :: e, n, p(2), box(2), low(2), heir(2)

    p = axes%degree
    n = size(followed, 2)
    box = [first1(minval(followed(1, :))), first2(minval(followed(2, :)))]
    associate (high => [first1(maxval(followed(1, :))), first2(maxval(followed(2, :)))] + p)
      allocate (coefficient(box(1):high(1), box(2):high(2)), source=0.0_wp)
      allocate (mass_share(box(1):high(1), box(2):high(2)), source=0.0_wp)
    end associate
    do e = 1, n
      low = [first1(followed(1, e)), first2(followed(2, e))]
      associate (part => coefficient(low(1):low(1) + p(1), low(2):low(2) + p(2)))
        part = part + spread(continued(axes(1), low(1), at(1)), 2, p(2) + 1) &
               *spread(continued(axes(2), low(2), at(2))/n, 1, p(1) + 1)
      end associate
      heir = min(max(at, low), low + p)
      mass_share(heir(1), heir(2)) = mass_share(heir(1), heir(2)) + 1.0_wp/n
    end do
    associate (counts => abs(coefficient) > 0.0_wp .or. mass_share > 0.0_wp)
      follower%at = at
      follower%coefficient = pack(coefficient, counts)
      follower%mass_share = pack(mass_share, counts)
      follower%leader = places_of(counts, box)
    end associate
  end subroutine follow

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
    integer :: t, k, c, l

    do c = 1, size(field, 4)
      do k = 1, size(field, 3)
        do t = 1, ties%n
          associate (point => ties%followers(t))
            value = 0.0_wp
            do l = 1, size(point%coefficient)
              value = value + point%coefficient(l) &
                      *field(point%leader(1, l), point%leader(2, l), k, c)
            end do
            field(point%at(1), point%at(2), k, c) = value
          end associate
        end do
      end do
    end do
  end subroutine lead_points

  !> Forces on followers go to their leaders: the transposed of `lead_points`.
  pure subroutine collect_forces(ties, field)
    type(outline_ties_t), intent(in) :: ties
    real(wp), intent(inout) :: field(:, :, :, :)
    integer :: t, k, c

    do c = 1, size(field, 4)
      do k = 1, size(field, 3)
        do t = 1, ties%n
          call give(ties%followers(t), ties%followers(t)%coefficient, field(:, :, k, c))
        end do
      end do
    end do
  end subroutine collect_forces

  !> The masses of followers go to control points of the elements that lead them.
  pure subroutine give_mass(ties, mass)
    type(outline_ties_t), intent(in) :: ties
    real(wp), intent(inout) :: mass(:, :, :)
    integer :: t, k

    do k = 1, size(mass, 3)
      do t = 1, ties%n
        call give(ties%followers(t), ties%followers(t)%mass_share, mass(:, :, k))
      end do
    end do
  end subroutine give_mass

  !> What a follower has goes to its leaders by their factors.
  pure subroutine give(follower, factors, field)
    type(follower_t), intent(in) :: follower
    real(wp), intent(in) :: factors(:)
    real(wp), intent(inout) :: field(:, :)
    integer :: l

    associate (own => field(follower%at(1), follower%at(2)))
      do l = 1, size(factors)
        associate (other => field(follower%leader(1, l), follower%leader(2, l)))
          other = other + factors(l)*own
        end associate
      end do
      own = 0.0_wp
    end associate
  end subroutine give

end module outline_ties
