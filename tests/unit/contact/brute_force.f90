!> Distance from a point to a surface without Newton: dense samples, then shrinking steps.
module brute_force
  use, intrinsic :: iso_fortran_env, only: int64
  use kinds, only: wp
  use knot_vector, only: span_table
  use nurbs_surface, only: nurbs_surface_t, evaluate_surface
  implicit none
  private

  public :: samples_t, new_samples, brute_distance, random_in

  integer, parameter :: n_along = 9   !! samples of a face in each direction, edges included

  !> Sample points of each face of a surface.
  type :: samples_t
    type(nurbs_surface_t) :: surface
    real(wp), allocatable :: low(:, :), high(:, :)    !! parametric range of each face, (2, n)
    real(wp), allocatable :: points(:, :, :, :)       !! shape (3, n_along, n_along, n)
    real(wp), allocatable :: reach(:)                 !! widest distance between neighbours
    real(wp), allocatable :: centre(:, :), radius(:)  !! of a ball around the samples of a face
  end type samples_t

contains

  function new_samples(surface) result(samples)
    type(nurbs_surface_t), intent(in) :: surface
    type(samples_t) :: samples
    integer, allocatable :: spans1(:), spans2(:)
    integer :: i, j, k, l, n
    real(wp) :: part(2)

    samples%surface = surface
    allocate (spans1, source=span_table(surface%axes(1)))
    allocate (spans2, source=span_table(surface%axes(2)))
    n = size(spans1)*size(spans2)
    allocate (samples%low(2, n), samples%high(2, n), samples%points(3, n_along, n_along, n))
    allocate (samples%reach(n), samples%centre(3, n), samples%radius(n))
    n = 0
    do j = 1, size(spans2)
      do i = 1, size(spans1)
        n = n + 1
        samples%low(:, n) = [surface%axes(1)%knots(spans1(i)), surface%axes(2)%knots(spans2(j))]
        samples%high(:, n) = [surface%axes(1)%knots(spans1(i) + 1), &
                              surface%axes(2)%knots(spans2(j) + 1)]
        do l = 1, n_along
          do k = 1, n_along
            part = real([k - 1, l - 1], wp)/(n_along - 1)
            call evaluate_surface(surface, samples%low(:, n) + part*(samples%high(:, n) &
              - samples%low(:, n)), samples%points(:, k, l, n))
          end do
        end do
        associate (p => samples%points(:, :, :, n), m => n_along)
          samples%reach(n) = sqrt(maxval(sum((p(:, 2:, :) - p(:, :m - 1, :))**2, 1))) &
                             + sqrt(maxval(sum((p(:, :, 2:) - p(:, :, :m - 1))**2, 1)))
          samples%centre(:, n) = p(:, (m + 1)/2, (m + 1)/2)
          samples%radius(n) = sqrt(maxval(squares_from(p, samples%centre(:, n))))
        end associate
      end do
    end do
  end function new_samples

  !> Distance from `x` to the surface: the best sample of every face that may hold the closest point
  !! is moved downhill within the face.
  real(wp) function brute_distance(samples, x) result(distance)
    type(samples_t), intent(in) :: samples
    real(wp), intent(in) :: x(3)
    real(wp) :: bound(size(samples%reach)), least(size(samples%reach)), nearest
    integer :: face, first, best(2)

    do face = 1, size(bound)
      bound(face) = norm2(x - samples%centre(:, face)) - samples%radius(face) - samples%reach(face)
    end do
    least = huge(1.0_wp)
    first = minloc(bound, 1)
    least(first) = least_of(samples, first, x)
    nearest = least(first)
    do face = 1, size(least)
      if (bound(face) > nearest .or. face == first) cycle
      least(face) = least_of(samples, face, x)
      nearest = min(nearest, least(face))
    end do
    distance = nearest
    do face = 1, size(least)
      if (least(face) - samples%reach(face) > distance) cycle
      best = minloc(squares_from(samples%points(:, :, :, face), x))
      distance = min(distance, moved_downhill(samples, x, face, real(best - 1, wp)/(n_along - 1)))
    end do
  end function brute_distance

  !> Distance from `x` to the nearest sample of a face.
  pure real(wp) function least_of(samples, face, x) result(least)
    type(samples_t), intent(in) :: samples
    integer, intent(in) :: face
    real(wp), intent(in) :: x(3)

    least = sqrt(minval(squares_from(samples%points(:, :, :, face), x)))
  end function least_of

  !> Squared distances from `x` to the samples of a face.
  pure function squares_from(points, x) result(squares)
    real(wp), intent(in) :: points(3, n_along, n_along), x(3)
    real(wp) :: squares(n_along, n_along)

    squares = (points(1, :, :) - x(1))**2 + (points(2, :, :) - x(2))**2 &
              + (points(3, :, :) - x(3))**2
  end function squares_from

  !> Try steps along eight directions, halve them where none helps.
  real(wp) function moved_downhill(samples, x, face, start) result(distance)
    type(samples_t), intent(in) :: samples
    real(wp), intent(in) :: x(3), start(2)
    integer, intent(in) :: face
    real(wp), parameter :: directions(2, 8) = reshape(real( &
      [1, 0, -1, 0, 0, 1, 0, -1, 1, 1, -1, -1, 1, -1, -1, 1], wp), [2, 8])
    real(wp) :: at(2), trial(2), step, found
    integer :: i
    logical :: is_lower

    at = start
    distance = distance_at(at)
    step = 0.5_wp/n_along
    do while (step > 1.0e-9_wp)
      is_lower = .false.
      do i = 1, 8
        trial = min(max(at + step*directions(:, i), 0.0_wp), 1.0_wp)
        found = distance_at(trial)
        if (found >= distance) cycle
        distance = found
        at = trial
        is_lower = .true.
      end do
      if (.not. is_lower) step = 0.5_wp*step
    end do

  contains

    real(wp) function distance_at(place)
      real(wp), intent(in) :: place(2)
      real(wp) :: point(3)

      call evaluate_surface(samples%surface, samples%low(:, face) &
        + place*(samples%high(:, face) - samples%low(:, face)), point)
      distance_at = norm2(x - point)
    end function distance_at

  end function moved_downhill

  !> Next point of a sequence of random points in a box, the same in every run: the generator of
  !! S. K. Park and K. W. Miller, Comm. ACM 31 (1988).
  subroutine random_in(box, seed, x)
    real(wp), intent(in) :: box(3, 2)        !! corners
    integer, intent(inout) :: seed           !! positive, carries the sequence on
    real(wp), intent(out) :: x(3)
    integer(int64), parameter :: modulus = 2147483647_int64, multiplier = 16807_int64
    integer :: i

    do i = 1, 3
      seed = int(mod(multiplier*seed, modulus))
      x(i) = box(i, 1) + (box(i, 2) - box(i, 1))*real(seed, wp)/modulus
    end do
  end subroutine random_in

end module brute_force
