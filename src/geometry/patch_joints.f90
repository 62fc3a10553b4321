!> Which faces of the patches of a body lie on each other, and whether they fit.
module patch_joints
  use kinds, only: wp
  use text, only: string_t, to_text
  use knot_vector, only: knot_vector_t
  use nurbs_surface, only: nurbs_surface_t
  use nurbs_solid, only: nurbs_solid_t, solid_face, face_axes
  use seams, only: seams_t, group_table
  implicit none
  private

  public :: joints_t, find_joints, face_names

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
              call add_misfit(joints, [p, f, p2, f2], reason)
            end if
          end do
        end do
        if (is_collapsed(faces(f, p))) joints%is_joined(f, p) = .true.
      end do
    end do
  end function find_joints

  subroutine add_misfit(joints, place, reason)
    type(joints_t), intent(inout) :: joints
    integer, intent(in) :: place(4)
    character(*), intent(in) :: reason
    type(string_t) :: added

    added%value = trim(face_names(place(2)))//" against "//trim(face_names(place(4)))//": "//reason
    joints%misfit = reshape([joints%misfit, place], [4, size(joints%misfit, 2) + 1])
    joints%reasons = [joints%reasons, added]
  end subroutine add_misfit

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

  pure function corners(face) result(groups)
    type(face_t), intent(in) :: face
    integer :: groups(4)

    associate (g => face%group, n => shape(face%group))
      groups = [g(1, 1), g(n(1), 1), g(1, n(2)), g(n(1), n(2))]
    end associate
  end function corners

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

    c = corners(a)
    d = corners(b)
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
      reason = to_text(size(a%group))//" and "//to_text(size(b%group))//" control points"
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

end module patch_joints
