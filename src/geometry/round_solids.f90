!> Round solids as patches with exact circles: disks, bars, rings, tubes and cups.
!!
!! A round section is a square core and a rim of two to four patches between its edges and the
!! circle, ruled in homogeneous coordinates, so that no position is degenerate. Neighbours have the
!! same knots, weights and control points on their common faces. Halves and quarters are those of a
!! whole solid. Circles are rational quadratics (L. Piegl and W. Tiller, The NURBS Book, 2nd ed.,
!! section 7.3), raised to the degree asked for.
module round_solids
  use kinds, only: wp
  use failure, only: error_t, fail
  use knot_vector, only: knot_vector_t, linear_axis
  use nurbs_surface, only: nurbs_surface_t, new_nurbs_surface
  use nurbs_solid, only: nurbs_solid_t, new_nurbs_solid
  use primitives, only: arc_t, unit_arc, plane_surface
  use refinement, only: elevate_degree, insert_knots, dividing_knots
  implicit none
  private

  public :: cylinder_solids, ring_solids, tube_solids, cup_solids

  !> What a round solid is made from. Angles count from the first of the two other axes, which
  !! follow `axis` in the order x, y, z.
  type, public :: round_shape_t
    real(wp) :: origin(3) = 0.0_wp          !! on the axis, where the solid begins [length]
    integer :: axis = 3                     !! direction of the axis: 1 x, 2 y, 3 z
    real(wp) :: radius = 0.0_wp             !! outer [length]
    real(wp) :: inner_radius = 0.0_wp       !! of rings and tubes [length]
    real(wp) :: height = 0.0_wp             !! along the axis [length]
    real(wp) :: start = 0.0_wp, angle = 360.0_wp   !! [degrees]; but for rings 90, 180 or 360
    real(wp) :: core = 0.5_wp               !! half the diagonal of the core, of the radius
    integer :: degrees(2) = 2               !! of the round plane and of the third direction
    integer :: n_elements(3) = 1            !! see the procedures
    real(wp) :: thickness = 0.0_wp          !! of cups [length]
    real(wp) :: corner = 0.0_wp             !! radius inside, between bottom and wall [length]
    integer :: n_along(2) = 1               !! elements along corner and wall
  end type round_shape_t

contains

  !> Disk with its thickness along axis 3, or bar with its length along axis 1. `n_elements`: along
  !! an eighth of the circle, across the rim, along that axis. The core comes first.
  subroutine cylinder_solids(shape, axis, solids, error)
    type(round_shape_t), intent(in) :: shape
    integer, intent(in) :: axis   !! 3 or 1
    type(nurbs_solid_t), allocatable, intent(out) :: solids(:)
    type(error_t), allocatable, intent(out) :: error
    type(nurbs_surface_t), allocatable :: section(:)
    integer :: p

    call round_section(shape, section, error)
    if (allocated(error)) return
    allocate (solids(size(section)))
    do p = 1, size(section)
      call sweep(shape, section(p), axis, solids(p), error)
      if (allocated(error)) return
    end do
  end subroutine cylinder_solids

  !> Flat ring: axis 1 with the angle, axis 2 from the outer to the inner circle, axis 3 along the
  !! thickness. `n_elements`: in each piece of the circle of at most a quarter, across, through.
  subroutine ring_solids(shape, solids, error)
    type(round_shape_t), intent(in) :: shape
    type(nurbs_solid_t), allocatable, intent(out) :: solids(:)
    type(error_t), allocatable, intent(out) :: error
    type(nurbs_surface_t) :: section

    allocate (solids(1))
    call ring_section(shape, section, error)
    if (allocated(error)) return
    call refine_section(section, shape%degrees(1), shape%n_elements(:2), error)
    if (allocated(error)) return
    call sweep(shape, section, 3, solids(1), error)
  end subroutine ring_solids

  !> Tube: axis 1 with the angle, axis 2 along the tube, axis 3 outward through the wall.
  !! `n_elements`: in each piece of the circle of at most a quarter, along, through the wall.
  subroutine tube_solids(shape, solids, error)
    type(round_shape_t), intent(in) :: shape
    type(nurbs_solid_t), allocatable, intent(out) :: solids(:)
    type(error_t), allocatable, intent(out) :: error
    type(nurbs_surface_t) :: section
    real(wp), allocatable :: points(:, :, :, :), weights(:, :, :)
    integer :: n, k

    allocate (solids(1))
    call ring_section(shape, section, error)
    if (allocated(error)) return
    n = section%axes(1)%n_basis
    allocate (points(n, 2, 2, 3), weights(n, 2, 2))
    do k = 1, 2
      points(:, :, k, :) = spread(section%points(:, 3 - k, :), 2, 2)
      weights(:, :, k) = spread(section%weights(:, 3 - k), 2, 2)
    end do
    points(:, 2, :, 3) = shape%height
    call new_nurbs_solid(solids(1), [section%axes(1), section%axes(2), section%axes(2)], points, &
                         weights, error)
    if (allocated(error)) return
    call refine_solid(solids(1), shape%degrees([1, 1, 2]), shape%n_elements, error)
    call move_into_frame(shape, solids(1))
  end subroutine tube_solids

  !> Cup: a flat bottom, a corner and a wall of one thickness, open above; `radius` and `height` are
  !! those of the outside. `n_elements`: along an eighth of the circle, across the rim of the
  !! bottom, through the thickness. The core comes first, then rims, corners and walls from the same
  !! angles on. Their axis 1 runs with the angle, axis 2 to the middle of the bottom, axis 3 inward.
  subroutine cup_solids(shape, solids, error)
    type(round_shape_t), intent(in) :: shape
    type(nurbs_solid_t), allocatable, intent(out) :: solids(:)
    type(error_t), allocatable, intent(out) :: error
    type(round_shape_t) :: bottom
    type(nurbs_solid_t), allocatable :: flat(:)
    type(arc_t) :: bend
    real(wp) :: r(3, 2), z(3, 2)   ! control points of the corner, outside and inside
    real(wp) :: radii(2)
    integer :: n

    bottom = shape
    bottom%height = shape%thickness
    bottom%radius = shape%radius - shape%thickness - shape%corner
    if (.not. (shape%corner > 0.0_wp .and. shape%thickness > 0.0_wp .and. bottom%radius > 0.0_wp &
               .and. shape%height > shape%thickness + shape%corner)) then
      call fail(error, "needs a positive corner radius and thickness, their sum below the "// &
                "radius and the height")
      return
    end if
    call cylinder_solids(bottom, 3, flat, error)
    if (allocated(error)) return
    n = size(flat) - 1
    allocate (solids(1 + 3*n))
    solids(:1 + n) = flat
    bend = unit_arc(0.0_wp, 90.0_wp)
    radii = shape%corner + [shape%thickness, 0.0_wp]
    r = bottom%radius + reshape([1, 1, 0, 1, 1, 0], [3, 2])*spread(radii, 1, 3)
    z = radii(1) - reshape([0, 1, 1, 0, 1, 1], [3, 2])*spread(radii, 1, 3)
    call revolve(shape, bend%axis, bend%weights, r, z, shape%n_along(1), &
                 solids(2 + n:1 + 2*n), error)
    if (allocated(error)) return
    z(2, :) = radii(1)
    z(1, :) = shape%height
    call revolve(shape, linear_axis(), [1.0_wp, 1.0_wp], r(:2, :), z(:2, :), shape%n_along(2), &
                 solids(2 + 2*n:), error)
  end subroutine cup_solids

  !> Draw a strip between two lines about the axis, in the pieces of the rim.
  subroutine revolve(shape, axis, weights, r, z, n_along, solids, error)
    type(round_shape_t), intent(in) :: shape
    type(knot_vector_t), intent(in) :: axis          !! of both lines
    real(wp), intent(in) :: weights(:)               !! of both lines
    real(wp), intent(in) :: r(:, :), z(:, :)         !! outer and inner line, shape (n, 2)
    integer, intent(in) :: n_along                   !! elements along the lines
    type(nurbs_solid_t), intent(inout) :: solids(:)
    type(error_t), allocatable, intent(out) :: error
    type(arc_t) :: arc
    type(knot_vector_t) :: through
    real(wp) :: points(3, size(r, 1), 2, 3), starts(size(solids) + 1)
    integer :: p, i

    starts = rim_angles(shape)
    through = linear_axis()
    do p = 1, size(solids)
      arc = rim_arc(starts(p), starts(p + 1) - starts(p))
      do i = 1, 3
        points(i, :, :, 1) = r*arc%points(i, 1)
        points(i, :, :, 2) = r*arc%points(i, 2)
        points(i, :, :, 3) = z
      end do
      call new_nurbs_solid(solids(p), [arc%axis, axis, through], points, &
                           spread(spread(arc%weights, 2, size(weights)) &
                                  *spread(weights, 1, 3), 3, 2), error)
      if (allocated(error)) return
      call refine_solid(solids(p), shape%degrees([1, 1, 2]), &
                        [nint((starts(p + 1) - starts(p))/45.0_wp)*shape%n_elements(1), n_along, &
                         shape%n_elements(3)], error)
      if (allocated(error)) return
      call move_into_frame(shape, solids(p))
    end do
  end subroutine revolve

  !> Sector of a ring in the plane of the first two coordinates: the outer circle, then the inner.
  subroutine ring_section(shape, section, error)
    type(round_shape_t), intent(in) :: shape
    type(nurbs_surface_t), intent(out) :: section
    type(error_t), allocatable, intent(out) :: error
    type(arc_t) :: arc
    real(wp), allocatable :: points(:, :, :)

    if (.not. (shape%inner_radius > 0.0_wp .and. shape%radius > shape%inner_radius &
               .and. shape%height > 0.0_wp)) then
      call fail(error, "needs 0 < inner radius < outer radius and a positive height")
    else if (.not. (shape%angle > 0.0_wp .and. shape%angle <= 360.0_wp)) then
      call fail(error, "the angle must be above 0 and at most 360 degrees")
    else
      arc = clean_arc(shape%start, shape%angle)
      allocate (points(arc%axis%n_basis, 2, 3), source=0.0_wp)
      points(:, 1, :2) = shape%radius*arc%points
      points(:, 2, :2) = shape%inner_radius*arc%points
      call new_nurbs_surface(section, arc%axis, linear_axis(), points, spread(arc%weights, 2, 2), &
                             error)
    end if
  end subroutine ring_section

  !> Core and rim of a disk or of its half or quarter, refined.
  subroutine round_section(shape, section, error)
    type(round_shape_t), intent(in) :: shape
    type(nurbs_surface_t), allocatable, intent(out) :: section(:)
    type(error_t), allocatable, intent(out) :: error
    real(wp), allocatable :: starts(:)
    real(wp) :: side, low(2), angle
    integer :: p, n, n_core(2)

    n = shape%n_elements(1)
    n_core = 2*n
    low = -1.0_wp
    starts = rim_angles(shape)
    if (size(starts) == 0) then
      call fail(error, "the angle must be 90, 180 or 360 degrees")
      return
    end if
    if (nint(shape%angle) < 360) then
      low(2) = 0.0_wp
      n_core(2) = n
    end if
    if (nint(shape%angle) == 90) then
      low(1) = 0.0_wp
      n_core(1) = n
    end if
    if (.not. (shape%radius > 0.0_wp .and. shape%height > 0.0_wp)) then
      call fail(error, "radius and height must be positive")
      return
    end if
    side = shape%core*shape%radius*sqrt(0.5_wp)
    allocate (section(size(starts)))
    call plane_surface(section(1), [low*side, 0.0_wp], [side - low(1)*side, 0.0_wp, 0.0_wp], &
                       [0.0_wp, side - low(2)*side, 0.0_wp], error)
    if (.not. allocated(error)) call refine_section(section(1), shape%degrees(1), n_core, error)
    do p = 2, size(section)
      if (allocated(error)) return
      angle = starts(p) - starts(p - 1)
      call rim_surface(starts(p - 1), angle, shape%radius, side, section(p), error)
      if (allocated(error)) return
      call refine_section(section(p), shape%degrees(1), &
                          [nint(angle/45.0_wp)*n, shape%n_elements(2)], error)
    end do
  end subroutine round_section

  !> Angles between which the patches of the rim lie [degrees]; none if the angle is not possible.
  pure function rim_angles(shape) result(starts)
    type(round_shape_t), intent(in) :: shape
    real(wp), allocatable :: starts(:)

    select case (nint(shape%angle))
    case (90)
      starts = [0.0_wp, 45.0_wp, 90.0_wp]
    case (180)
      starts = [0.0_wp, 45.0_wp, 135.0_wp, 180.0_wp]
    case (360)
      starts = [-45.0_wp, 45.0_wp, 135.0_wp, 225.0_wp, 315.0_wp]
    case default
      allocate (starts(0))
    end select
  end function rim_angles

  !> One patch of the rim: axis 1 with the angle, axis 2 from the circle to the core.
  subroutine rim_surface(start, angle, radius, side, surface, error)
    real(wp), intent(in) :: start, angle, radius, side   !! angles in degrees
    type(nurbs_surface_t), intent(out) :: surface
    type(error_t), allocatable, intent(out) :: error
    type(arc_t) :: arc
    real(wp) :: points(3, 2, 3), weights(3, 2)

    arc = rim_arc(start, angle)
    points = 0.0_wp
    points(:, 1, :2) = radius*arc%points
    points(1, 2, :2) = side*edge_of_core(start)
    points(3, 2, :2) = side*edge_of_core(start + angle)
    points(2, 2, :) = 0.5_wp*(points(1, 2, :) + points(3, 2, :))
    weights(:, 1) = arc%weights
    weights(:, 2) = 1.0_wp
    call new_nurbs_surface(surface, arc%axis, linear_axis(), points, weights, error)
  end subroutine rim_surface

  !> One piece of the circle. Those of 45 degrees are halves of one of 90, so that the first two
  !! weights at an axis, which may be a plane of symmetry, are equal: in the rim, too, the row next
  !! to it lies straight across.
  pure function rim_arc(start, angle) result(arc)
    real(wp), intent(in) :: start, angle         !! [degrees]
    type(arc_t) :: arc

    arc = clean_arc(start, angle)
    associate (w => arc%weights)
      if (mod(nint(start), 90) == 0) w(:2) = w(2)**2
      if (mod(nint(start + angle), 90) == 0) w(2:) = w(2)**2
    end associate
  end function rim_arc

  !> Where the ray at a multiple of 45 degrees leaves a square of half side 1.
  pure function edge_of_core(angle) result(corner)
    real(wp), intent(in) :: angle
    real(wp) :: corner(2)
    real(wp), parameter :: degree = acos(-1.0_wp)/180, more_than_root = 1.2_wp

    corner = anint(more_than_root*[cos(angle*degree), sin(angle*degree)])
  end function edge_of_core

  !> Unit arc without the round-off of angles that lie on an axis.
  pure function clean_arc(start, angle) result(arc)
    real(wp), intent(in) :: start, angle
    type(arc_t) :: arc
    real(wp), parameter :: round_off = 1.0e-14_wp

    arc = unit_arc(start, angle)
    where (abs(arc%points) < round_off) arc%points = 0.0_wp
  end function clean_arc

  subroutine refine_section(section, degree, n_elements, error)
    type(nurbs_surface_t), intent(inout) :: section
    integer, intent(in) :: degree, n_elements(2)
    type(error_t), allocatable, intent(out) :: error
    integer :: axis

    do axis = 1, 2
      call elevate_degree(section, axis, degree - section%axes(axis)%degree, error)
      if (allocated(error)) return
      call insert_knots(section, axis, dividing_knots(section%axes(axis), n_elements(axis)), error)
      if (allocated(error)) return
    end do
  end subroutine refine_section

  subroutine refine_solid(solid, degrees, n_elements, error)
    type(nurbs_solid_t), intent(inout) :: solid
    integer, intent(in) :: degrees(3), n_elements(3)
    type(error_t), allocatable, intent(out) :: error
    integer :: axis

    do axis = 1, 3
      call elevate_degree(solid, axis, degrees(axis) - solid%axes(axis)%degree, error)
      if (allocated(error)) return
      call insert_knots(solid, axis, dividing_knots(solid%axes(axis), n_elements(axis)), error)
      if (allocated(error)) return
    end do
  end subroutine refine_solid

  !> Draw a refined section along the height, which becomes axis 1 or axis 3, and put it in place.
  subroutine sweep(shape, section, axis, solid, error)
    type(round_shape_t), intent(in) :: shape
    type(nurbs_surface_t), intent(in) :: section
    integer, intent(in) :: axis
    type(nurbs_solid_t), intent(out) :: solid
    type(error_t), allocatable, intent(out) :: error
    real(wp), allocatable :: points(:, :, :, :)
    type(knot_vector_t) :: axes(3)

    points = spread(section%points, axis, 2)
    axes(axis) = linear_axis()
    if (axis == 3) then
      axes(:2) = section%axes
      points(:, :, 2, 3) = shape%height
    else
      axes(2:) = section%axes
      points(2, :, :, 3) = shape%height
    end if
    call new_nurbs_solid(solid, axes, points, spread(section%weights, axis, 2), error)
    if (allocated(error)) return
    call elevate_degree(solid, axis, shape%degrees(2) - 1, error)
    if (allocated(error)) return
    call insert_knots(solid, axis, dividing_knots(solid%axes(axis), shape%n_elements(3)), error)
    call move_into_frame(shape, solid)
  end subroutine sweep

  !> From coordinates about the axis z to those of the shape.
  pure subroutine move_into_frame(shape, solid)
    type(round_shape_t), intent(in) :: shape
    type(nurbs_solid_t), intent(inout) :: solid
    real(wp), allocatable :: local(:, :, :, :)
    integer :: c, to

    local = solid%points
    do c = 1, 3
      to = mod(shape%axis + c - 1, 3) + 1
      solid%points(:, :, :, to) = shape%origin(to) + local(:, :, :, c)
    end do
  end subroutine move_into_frame

end module round_solids
