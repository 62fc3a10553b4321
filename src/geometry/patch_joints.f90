!> Which faces of the patches of a body coincide, and whether they fit.
!!
!! Faces may also coincide without sharing control points, so that nothing joins them (tee joints):
!! a patch that ends at the middle of another's side, or two with shifted sides.
module patch_joints
  use kinds, only: wp
  use text, only: string_t, to_text, append_text, counted
  use knot_vector, only: knot_vector_t
  use nurbs_surface, only: nurbs_surface_t, evaluate_surface
  use nurbs_solid, only: nurbs_solid_t, solid_face, face_axes
  use patch_seams, only: seams_t, group_table
  implicit none
  private

  public :: joints_t, find_joints, face_names, find_tee_joints

  character(8), parameter :: face_names(6) = [character(8) :: "XI_MIN", "XI_MAX", "ETA_MIN", &
                                              "ETA_MAX", "ZETA_MIN", "ZETA_MAX"]

  !> What was found.
  type :: joints_t
    logical, allocatable :: is_joined(:, :)       !! face on another face, shape (6, patches)
    logical, allocatable :: is_tied(:, :)         !! patches with a common face, (patches, patches)
    integer, allocatable :: misfit(:, :)          !! patch, face, patch, face; shape (4, n)
    type(string_t), allocatable :: reasons(:)     !! why they do not fit, shape (n)
  end type joints_t

  !> A face: seams of its control points, 0 for those on none.
  type :: face_t
    integer, allocatable :: group(:, :)
    type(nurbs_surface_t) :: surface
  end type face_t

  integer, parameter :: n_samples = 4   ! of a face in each direction

  !> An open face and the box of its control points.
  type :: open_face_t
    integer :: patch = 0, face = 0
    type(nurbs_surface_t) :: surface
    real(wp) :: low(3), high(3)
  end type open_face_t

contains

  !> Compare all faces that share control points.
  function find_joints(solids, seams) result(joints)
    type(nurbs_solid_t), intent(in) :: solids(:)
    type(seams_t), intent(in) :: seams
    type(joints_t) :: joints
    type(face_t) :: faces(6, size(solids))
    character(:), allocatable :: reason
    integer :: p, f, p2, f2

    allocate (joints%is_joined(6, size(solids)), joints%is_tied(size(solids), size(solids)))
    allocate (joints%misfit(4, 0), joints%reasons(0))
    joints%is_joined = .false.
    joints%is_tied = .false.
    if (seams%n_groups == 0) return
    do p = 1, size(solids)
      call set_faces(solids(p), group_table(seams, p, size(solids(p)%weights)), faces(:, p))
    end do
    do p = 1, size(solids)
      do f = 1, 6
        do p2 = 1, size(solids)
          do f2 = 1, 6
            if (p2 == p .and. f2 == f) cycle
            if (.not. shares_corners(faces(f, p), faces(f2, p2))) cycle
            reason = why_not(faces(f, p), faces(f2, p2), seams%n_groups)
            if (reason == "") then
              joints%is_joined(f, p) = .true.
              joints%is_tied(p, p2) = .true.
              joints%is_tied(p2, p) = .true.
            else if (p < p2 .or. (p == p2 .and. f < f2)) then
              joints%misfit = reshape([joints%misfit, p, f, p2, f2], &
                                      [4, size(joints%misfit, 2) + 1])
              call append_text(joints%reasons, trim(face_names(f))//" against "// &
                               trim(face_names(f2))//": "//reason)
            end if
          end do
        end do
        if (is_collapsed(faces(f, p))) joints%is_joined(f, p) = .true.
      end do
    end do
  end function find_joints

  pure subroutine set_faces(solid, groups, faces)
    type(nurbs_solid_t), intent(in) :: solid
    integer, intent(in) :: groups(:)
    type(face_t), intent(inout) :: faces(6)
    integer, allocatable :: grid(:, :, :)
    integer :: f, axis, layer, n(3), m(2)

    n = solid%axes%n_basis
    grid = reshape(groups, n)
    do f = 1, 6
      axis = (f + 1)/2
      layer = merge(1, n(axis), mod(f, 2) == 1)
      m = n(face_axes(f))
      faces(f)%surface = solid_face(solid, f)
      if (axis == 1) faces(f)%group = reshape(grid(layer, :, :), m)
      if (axis == 2) faces(f)%group = reshape(grid(:, layer, :), m)
      if (axis == 3) faces(f)%group = reshape(grid(:, :, layer), m)
    end do
  end subroutine set_faces

  !> A face without area: each of its lines in one direction is a single point.
  pure logical function is_collapsed(face)
    type(face_t), intent(in) :: face
    integer :: i

    associate (g => face%group)
      is_collapsed = all(g > 0)
      if (.not. is_collapsed) return
      is_collapsed = all([(all(g(:, i) == g(1, i)), i=1, size(g, 2))]) .or. &
                     all([(all(g(i, :) == g(i, 1)), i=1, size(g, 1))])
    end associate
  end function is_collapsed

  !> Do two faces with extent have all four corners in common, and do they lie on each other there?
  pure logical function shares_corners(a, b)
    type(face_t), intent(in) :: a, b
    integer :: c(4), d(4), i

    c = reshape(a%group(::size(a%group, 1) - 1, ::size(a%group, 2) - 1), [4])
    d = reshape(b%group(::size(b%group, 1) - 1, ::size(b%group, 2) - 1), [4])
    shares_corners = all(c > 0) .and. .not. is_collapsed(a) .and. .not. is_collapsed(b)
    if (shares_corners) shares_corners = all([(any(d == c(i)), i=1, 4)])
  end function shares_corners

  !> Why two faces with common corners do not fit; empty if they do.
  function why_not(a, b, n_groups) result(reason)
    type(face_t), intent(in) :: a, b
    integer, intent(in) :: n_groups
    character(:), allocatable :: reason
    real(wp) :: weight_of(n_groups), ratio, least, largest
    integer :: i, j

    reason = ""
    if (size(a%group) /= size(b%group)) then
      reason = to_text(size(a%group))//" and "//counted(size(b%group), "control point")
      return
    end if
    weight_of = 0.0_wp
    do j = 1, size(b%group, 2)
      do i = 1, size(b%group, 1)
        if (b%group(i, j) > 0) weight_of(b%group(i, j)) = b%surface%weights(i, j)
      end do
    end do
    least = huge(1.0_wp)
    largest = 0.0_wp
    do j = 1, size(a%group, 2)
      do i = 1, size(a%group, 1)
        ratio = 0.0_wp
        if (a%group(i, j) > 0) ratio = weight_of(a%group(i, j))/a%surface%weights(i, j)
        least = min(least, ratio)
        largest = max(largest, ratio)
      end do
    end do
    if (least <= 0.0_wp) then
      reason = "control points that are not all in the same places"
    else if (largest > least*(1.0_wp + 1.0e-9_wp)) then
      reason = "different weights"
    else if (.not. have_same_knots(a%surface%axes, b%surface%axes)) then
      reason = "different degrees or knots"
    end if
  end function why_not

  !> Equal knot vectors but for order, scale and direction.
  pure logical function have_same_knots(a, b)
    type(knot_vector_t), intent(in) :: a(2), b(2)

    have_same_knots = (are_alike(a(1), b(1)) .and. are_alike(a(2), b(2))) .or. &
                      (are_alike(a(1), b(2)) .and. are_alike(a(2), b(1)))
  end function have_same_knots

  pure logical function are_alike(a, b)
    type(knot_vector_t), intent(in) :: a, b
    real(wp), parameter :: tolerance = 1.0e-9_wp

    are_alike = a%degree == b%degree .and. size(a%knots) == size(b%knots)
    if (.not. are_alike) return
    associate (x => unit_knots(a), y => unit_knots(b))
      are_alike = maxval(abs(x - y)) < tolerance .or. &
                  maxval(abs(x - (1.0_wp - y(size(y):1:-1)))) < tolerance
    end associate
  end function are_alike

  pure function unit_knots(axis) result(knots)
    type(knot_vector_t), intent(in) :: axis
    real(wp) :: knots(size(axis%knots))

    associate (k => axis%knots)
      knots = (k - k(1))/(k(size(k)) - k(1))
    end associate
  end function unit_knots

  !> Pairs of open faces of two patches with positions inside one that lie on the other.
  pure function find_tee_joints(solids, is_joined, tolerance) result(pairs)
    type(nurbs_solid_t), intent(in) :: solids(:)
    logical, intent(in) :: is_joined(:, :)      !! faces to leave out, shape (6, patches)
    real(wp), intent(in) :: tolerance           !! [length]
    integer, allocatable :: pairs(:, :)         !! patch, face, patch, face; shape (4, n)
    type(open_face_t), allocatable :: faces(:)
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
    type(open_face_t), allocatable :: faces(:)
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

  !> Does any of some points inside a surface lie on a face?
  pure logical function lies_on(surface, other, tolerance)
    type(nurbs_surface_t), intent(in) :: surface
    type(open_face_t), intent(in) :: other
    real(wp), intent(in) :: tolerance
    real(wp) :: xi(2), point(3)
    integer :: i, j

    lies_on = .false.
    do j = 1, n_samples
      do i = 1, n_samples
        xi = position_at(surface, ([i, j] - 0.5_wp)/n_samples)
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
        xi = position_at(surface, real([i, j], wp)/n)
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
      best = max(best, position_at(surface, [0.0_wp, 0.0_wp]))
      best = min(best, position_at(surface, [1.0_wp, 1.0_wp]))
      call evaluate_surface(surface, best, at)
      distance = min(distance, norm2(at - point))
    end do
  end function distance_to

  !> Parametric coordinates of fractions of the range along both axes.
  pure function position_at(surface, fraction) result(xi)
    type(nurbs_surface_t), intent(in) :: surface
    real(wp), intent(in) :: fraction(2)
    real(wp) :: xi(2)
    integer :: d

    do d = 1, 2
      associate (knots => surface%axes(d)%knots)
        xi(d) = knots(1) + (knots(size(knots)) - knots(1))*fraction(d)
      end associate
    end do
  end function position_at

end module patch_joints
