!> Distance from a point to a surface without Newton: dense samples, then shrinking steps.
module brute_force
  use, intrinsic :: iso_fortran_env, only: int64
  use kinds, only: wp
  use nurbs_surface, only: nurbs_surface_t
  use bezier, only: bezier_face_t, bezier_faces
  implicit none
  private

  public :: samples_t, new_samples, brute_distance, random_in

  integer, parameter :: n_along = 9   !! samples of a face in each direction, edges included

  !> Bezier points and samples of each face of a surface.
  type :: samples_t
    integer :: orders(2) = 0                          !! degrees + 1
    real(wp), allocatable :: hulls(:, :, :, :)        !! homogeneous, shape (4, orders, n)
    real(wp), allocatable :: points(:, :, :, :)       !! shape (n_along, n_along, 3, n)
    real(wp), allocatable :: reach(:)                 !! farthest that a place is from a sample
    real(wp), allocatable :: centre(:, :), radius(:)  !! of a ball around the samples of a face
  end type samples_t

contains

  function new_samples(surface) result(samples)
    type(nurbs_surface_t), intent(in) :: surface
    type(samples_t) :: samples
    type(bezier_face_t), allocatable :: faces(:)
    integer :: k, l, n

    faces = bezier_faces(surface)
    samples%orders = surface%axes%degree + 1
    n = size(faces)
    allocate (samples%hulls(4, samples%orders(1), samples%orders(2), n))
    allocate (samples%points(n_along, n_along, 3, n))
    allocate (samples%reach(n), samples%centre(3, n), samples%radius(n))
    do n = 1, size(faces)
      samples%hulls(:, :, :, n) = faces(n)%hull
      do l = 1, n_along
        do k = 1, n_along
          samples%points(k, l, :, n) = face_point(samples%orders, samples%hulls(:, :, :, n), &
                                                  real([k - 1, l - 1], wp)/(n_along - 1))
        end do
      end do
      associate (p => samples%points(:, :, :, n), m => n_along)
        ! Half the sides of the widest mesh, and a fifth for its bend.
        samples%reach(n) = 0.6_wp*(sqrt(maxval(sum((p(2:, :, :) - p(:m - 1, :, :))**2, 3))) &
                                   + sqrt(maxval(sum((p(:, 2:, :) - p(:, :m - 1, :))**2, 3))))
        samples%centre(:, n) = p((m + 1)/2, (m + 1)/2, :)
        samples%radius(n) = sqrt(maxval(squares_from(p, samples%centre(:, n))))
      end associate
    end do
  end function new_samples

  !> Distance from `x` to the surface: in every face that may hold the closest point each sample
  !! that is nearer than those around it is moved downhill within the face.
  pure real(wp) function brute_distance(samples, x) result(distance)
    type(samples_t), intent(in) :: samples
    real(wp), intent(in) :: x(3)
    real(wp) :: bound(size(samples%reach)), squares(0:n_along + 1, 0:n_along + 1), nearest
    integer :: face, first, k, l

    do face = 1, size(bound)
      bound(face) = sqrt((x(1) - samples%centre(1, face))**2 + (x(2) - samples%centre(2, face))**2 &
                         + (x(3) - samples%centre(3, face))**2) &
                    - samples%radius(face) - samples%reach(face)
    end do
    first = minloc(bound, 1)
    nearest = sqrt(minval(squares_from(samples%points(:, :, :, first), x)))
    do face = 1, size(bound)
      if (bound(face) > nearest .or. face == first) cycle
      nearest = min(nearest, sqrt(minval(squares_from(samples%points(:, :, :, face), x))))
    end do
    distance = nearest
    squares = huge(1.0_wp)
    do face = 1, size(bound)
      if (bound(face) > distance) cycle
      squares(1:n_along, 1:n_along) = squares_from(samples%points(:, :, :, face), x)
      do l = 1, n_along
        do k = 1, n_along
          if (squares(k, l) > minval(squares(k - 1:k + 1, l - 1:l + 1))) cycle
          if (sqrt(squares(k, l)) - samples%reach(face) > distance) cycle
          distance = min(distance, moved_downhill(samples%orders, samples%hulls(:, :, :, face), x, &
                                                  real([k - 1, l - 1], wp)/(n_along - 1)))
        end do
      end do
    end do
  end function brute_distance

  !> Squared distances from `x` to the samples of a face.
  pure function squares_from(points, x) result(squares)
    real(wp), intent(in) :: points(n_along, n_along, 3), x(3)
    real(wp) :: squares(n_along, n_along)

    squares = (points(:, :, 1) - x(1))**2 + (points(:, :, 2) - x(2))**2 &
              + (points(:, :, 3) - x(3))**2
  end function squares_from

  !> Least distance that steps along eight directions come to. Where none helps the bottom of the
  !! paraboloid through these places is tried and the steps become shorter.
  pure real(wp) function moved_downhill(orders, hull, x, start) result(distance)
    integer, intent(in) :: orders(2)
    real(wp), intent(in) :: hull(4, orders(1), orders(2)), x(3), start(2)
    real(wp), parameter :: longest = 0.5_wp/n_along, shortest = 1.0e-8_wp, shorter = 0.2_wp
    real(wp) :: at(2), trial(2), step, around(-1:1, -1:1), slope(2), bend(2), twist, bottom(2)
    integer :: i, j, best(2)

    at = start
    step = longest
    around(0, 0) = sum((x - face_point(orders, hull, at))**2)
    do while (step > shortest)
      do j = -1, 1
        do i = -1, 1
          if (i == 0 .and. j == 0) cycle
          trial = min(max(at + step*[i, j], 0.0_wp), 1.0_wp)
          around(i, j) = sum((x - face_point(orders, hull, trial))**2)
        end do
      end do
      best = minloc(around) - 2
      if (around(best(1), best(2)) < around(0, 0)) then
        at = min(max(at + step*best, 0.0_wp), 1.0_wp)
        around(0, 0) = around(best(1), best(2))
        step = min(1.5_wp*step, longest)
        cycle
      end if
      slope = 0.5_wp*[around(1, 0) - around(-1, 0), around(0, 1) - around(0, -1)]
      bend = [around(1, 0) + around(-1, 0), around(0, 1) + around(0, -1)] - 2*around(0, 0)
      twist = 0.25_wp*(around(1, 1) + around(-1, -1) - around(1, -1) - around(-1, 1))
      bottom = [twist*slope(2) - bend(2)*slope(1), twist*slope(1) - bend(1)*slope(2)] &
               /max(product(bend) - twist**2, tiny(1.0_wp))
      trial = min(max(at + step*min(max(bottom, -1.0_wp), 1.0_wp), 0.0_wp), 1.0_wp)
      slope(1) = sum((x - face_point(orders, hull, trial))**2)
      if (slope(1) < around(0, 0)) then
        at = trial
        around(0, 0) = slope(1)
      end if
      step = shorter*step
    end do
    distance = sqrt(around(0, 0))
  end function moved_downhill

  !> Point of a face by Bernstein polynomials.
  pure function face_point(orders, hull, at) result(point)
    integer, intent(in) :: orders(2)
    real(wp), intent(in) :: hull(4, orders(1), orders(2)), at(2)
    real(wp) :: point(3), b1(orders(1)), b2(orders(2)), h(4), row(4)
    integer :: i, j

    b1 = bernstein(orders(1), at(1))
    b2 = bernstein(orders(2), at(2))
    h = 0.0_wp
    do j = 1, orders(2)
      row = 0.0_wp
      do i = 1, orders(1)
        row = row + b1(i)*hull(:, i, j)
      end do
      h = h + b2(j)*row
    end do
    point = h(:3)/h(4)
  end function face_point

  pure function bernstein(order, s) result(b)
    integer, intent(in) :: order
    real(wp), intent(in) :: s
    real(wp) :: b(order)
    integer :: i, k

    b(1) = 1.0_wp
    do k = 2, order
      b(k) = s*b(k - 1)
      do i = k - 1, 2, -1
        b(i) = s*b(i - 1) + (1.0_wp - s)*b(i)
      end do
      b(1) = (1.0_wp - s)*b(1)
    end do
  end function bernstein

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
