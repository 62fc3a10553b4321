!> Faces of patches that lie on each other without sharing their control points, so that nothing
!! joins them: a patch that ends at the middle of another's side, or two with shifted sides.
module tee_joints
  use kinds, only: wp
  use nurbs_surface, only: nurbs_surface_t, evaluate_surface
  use nurbs_solid, only: nurbs_solid_t, solid_face
  implicit none
  private

  public :: find_tee_joints

  integer, parameter :: n_samples = 4   ! of a face in each direction

  !> An open face and the box of its control points.
  type :: face_t
    integer :: patch = 0, face = 0
    type(nurbs_surface_t) :: surface
    real(wp) :: low(3), high(3)
  end type face_t

contains

  !> Pairs of open faces of two patches with places inside one that lie on the other.
  pure function find_tee_joints(solids, is_joined, tolerance) result(pairs)
    type(nurbs_solid_t), intent(in) :: solids(:)
    logical, intent(in) :: is_joined(:, :)      !! faces to leave out, shape (6, patches)
    real(wp), intent(in) :: tolerance           !! [length]
    integer, allocatable :: pairs(:, :)         !! patch, face, patch, face; shape (4, n)
    type(face_t), allocatable :: faces(:)
    integer :: i, j

    faces = open_faces(solids, is_joined)
    allocate (pairs(4, 0))
    do i = 1, size(faces)
      do j = i + 1, size(faces)
        associate (a => faces(i), b => faces(j))
          if (a%patch == b%patch) cycle
          if (any(a%low > b%high + tolerance .or. b%low > a%high + tolerance)) cycle
          if (lies_on(a%surface, b, tolerance) .or. lies_on(b%surface, a, tolerance)) &
            pairs = reshape([pairs, a%patch, a%face, b%patch, b%face], [4, size(pairs, 2) + 1])
        end associate
      end do
    end do
  end function find_tee_joints

  pure function open_faces(solids, is_joined) result(faces)
    type(nurbs_solid_t), intent(in) :: solids(:)
    logical, intent(in) :: is_joined(:, :)
    type(face_t), allocatable :: faces(:)
    integer :: p, f, n, c

    allocate (faces(count(.not. is_joined)))
    n = 0
    do p = 1, size(solids)
      do f = 1, 6
        if (is_joined(f, p)) cycle
        n = n + 1
        faces(n)%patch = p
        faces(n)%face = f
        faces(n)%surface = solid_face(solids(p), f)
        do c = 1, 3
          faces(n)%low(c) = minval(faces(n)%surface%points(:, :, c))
          faces(n)%high(c) = maxval(faces(n)%surface%points(:, :, c))
        end do
      end do
    end do
  end function open_faces

  !> Does any of some places inside a surface lie on a face?
  pure logical function lies_on(surface, other, tolerance)
    type(nurbs_surface_t), intent(in) :: surface
    type(face_t), intent(in) :: other
    real(wp), intent(in) :: tolerance
    real(wp) :: xi(2), point(3)
    integer :: i, j

    lies_on = .false.
    do j = 1, n_samples
      do i = 1, n_samples
        xi = place(surface, ([i, j] - 0.5_wp)/n_samples)
        call evaluate_surface(surface, xi, point)
        if (any(point < other%low - tolerance .or. point > other%high + tolerance)) cycle
        lies_on = distance_to(other%surface, point, tolerance) <= tolerance
        if (lies_on) return
      end do
    end do
  end function lies_on

  !> Distance of a point from a surface, by Newton's method from the nearest of a grid; what is more
  !! than `enough` may come out too large.
  pure real(wp) function distance_to(surface, point, enough) result(distance)
    type(nurbs_surface_t), intent(in) :: surface
    real(wp), intent(in) :: point(3), enough
    integer, parameter :: n_steps = 20
    real(wp) :: xi(2), best(2), at(3), d1(3, 2), gap(3), a(2, 2), b(2), det
    integer :: i, j, n(2)

    n = 2*max(surface%axes%n_basis, n_samples)
    distance = huge(1.0_wp)
    do j = 0, n(2)
      do i = 0, n(1)
        xi = place(surface, real([i, j], wp)/n)
        call evaluate_surface(surface, xi, at)
        if (norm2(at - point) >= distance) cycle
        distance = norm2(at - point)
        best = xi
      end do
    end do
    do i = 1, n_steps
      if (distance <= enough) return
      call evaluate_surface(surface, best, at, d1)
      gap = point - at
      a = matmul(transpose(d1), d1)
      b = matmul(gap, d1)
      det = a(1, 1)*a(2, 2) - a(1, 2)*a(2, 1)
      if (det <= tiny(1.0_wp)) return
      best = best + [a(2, 2)*b(1) - a(1, 2)*b(2), a(1, 1)*b(2) - a(2, 1)*b(1)]/det
      best = max(best, place(surface, [0.0_wp, 0.0_wp]))
      best = min(best, place(surface, [1.0_wp, 1.0_wp]))
      call evaluate_surface(surface, best, at)
      distance = min(distance, norm2(at - point))
    end do
  end function distance_to

  !> Parametric coordinates of shares of the way along both axes.
  pure function place(surface, share) result(xi)
    type(nurbs_surface_t), intent(in) :: surface
    real(wp), intent(in) :: share(2)
    real(wp) :: xi(2), first, last
    integer :: axis

    do axis = 1, 2
      associate (knots => surface%axes(axis)%knots)
        first = knots(1)
        last = knots(size(knots))
      end associate
      xi(axis) = first + (last - first)*share(axis)
    end do
  end function place

end module tee_joints
