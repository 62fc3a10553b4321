!> Where a tool bends towards the sheet, and how sharply: radii that elements must be fit for.
module tool_bends
  use kinds, only: wp
  use linear_algebra, only: cross
  use tool, only: tool_t
  use edge_contact, only: is_on_tool
  use tool_face, only: face_derivatives, unit_normal
  use tool_seams, only: edge_position
  implicit none
  private

  public :: bend_t, tool_bends_below, sharpest_radius

  !> Elements that a radius is long at least, for the sheet to bend around it.
  real(wp), parameter, public :: elements_on_radius = 3.0_wp

  integer, parameter :: least_along = 3          !! positions on a face, along each direction
  integer, parameter :: most_bends = 3000        !! kept of a tool
  real(wp), parameter :: inset = 0.02_wp         !! from edges, which may be shrunk to a point
  real(wp), parameter :: sharp = 0.35_wp         !! turn of normals at an edge that has no radius

  !> A position that bends towards the sheet.
  type :: bend_t
    real(wp) :: radius = 0.0_wp     !! 0: an edge [length]
    real(wp) :: x(3) = 0.0_wp       !! in the tool's frame [length]
    real(wp) :: direction(3) = 0.0_wp     !! unit vector along which it bends
    real(wp) :: normal(3) = 0.0_wp  !! unit, towards the sheet
  end type bend_t

contains

  !> Positions of a tool where it bends towards the sheet with a radius below a limit; of very many
  !! every n-th. Edges between faces whose normals part by more than 20 degrees have the radius 0.
  subroutine tool_bends_below(tool, limit, bends)
    type(tool_t), intent(in) :: tool
    real(wp), intent(in) :: limit                        !! [length]
    type(bend_t), allocatable, intent(out) :: bends(:)
    type(bend_t), allocatable :: found(:)
    integer :: i

    call find_bends(tool, limit, found)
    i = (size(found) + most_bends - 1)/most_bends
    bends = found(::max(i, 1))
  end subroutine tool_bends_below

  !> All of them, at the positions that are checked.
  subroutine find_bends(tool, limit, bends)
    type(tool_t), intent(in) :: tool
    real(wp), intent(in) :: limit                        !! [length]
    type(bend_t), allocatable, intent(out) :: bends(:)
    type(bend_t), allocatable :: found(:)
    type(bend_t) :: bend
    real(wp) :: at(2)
    integer :: face, edge, i, j, n, n_along(2)

    ! The curvature of a face may change as often as its control points are many.
    n_along = max(least_along, 2*tool%orders - 1)
    allocate (found((product(n_along) + 2*sum(n_along))*tool%n_faces))
    n = 0
    do face = 1, tool%n_faces
      do j = 1, n_along(2)
        do i = 1, n_along(1)
          at = inset + (1 - 2*inset)*[i - 1, j - 1]/(n_along - 1)
          if (.not. is_on_tool(tool, face, at)) cycle
          bend = bend_at(tool, face, at)
          call append(bend)
        end do
      end do
      do edge = 1, 4
        if (tool%neighbours(edge, face) == 0) cycle
        do i = 1, n_along(merge(2, 1, edge <= 2))
          at = edge_position(edge, (i - 0.5_wp)/n_along(merge(2, 1, edge <= 2)))
          if (.not. is_on_tool(tool, face, at)) cycle
          bend = bend_across(tool, face, edge, (i - 0.5_wp)/n_along(merge(2, 1, edge <= 2)))
          call append(bend)
        end do
      end do
    end do
    bends = found(:n)

  contains

    subroutine append(bend)
      type(bend_t), intent(in) :: bend

      if (.not. bend%radius < limit) return
      n = n + 1
      found(n) = bend
    end subroutine append

  end subroutine find_bends

  !> Smallest radius with which a tool bends towards the sheet, huge where it does not.
  real(wp) function sharpest_radius(tool) result(radius)
    type(tool_t), intent(in) :: tool
    type(bend_t), allocatable :: bends(:)

    call find_bends(tool, huge(1.0_wp), bends)
    radius = minval([bends%radius, huge(1.0_wp)])
  end function sharpest_radius

  !> Largest curvature towards the sheet at a position of a face.
  pure function bend_at(tool, face, at) result(bend)
    type(tool_t), intent(in) :: tool
    integer, intent(in) :: face
    real(wp), intent(in) :: at(2)
    type(bend_t) :: bend
    real(wp) :: d1(3, 2), d2(3, 3), normal(3), e, f, g, l, m, n, area, mean, root, k, v(2)

    bend%radius = huge(1.0_wp)
    call face_derivatives(tool%coefficients, face, at, bend%x, d1, d2)
    normal = tool%side*unit_normal(d1)
    bend%normal = normal
    e = sum(d1(:, 1)**2)
    f = sum(d1(:, 1)*d1(:, 2))
    g = sum(d1(:, 2)**2)
    area = e*g - f**2
    if (.not. sum(normal**2) > 0.0_wp .or. .not. area > 0.0_wp) return
    l = sum(d2(:, 1)*normal)
    n = sum(d2(:, 2)*normal)
    m = sum(d2(:, 3)*normal)
    mean = 0.5_wp*(l*g - 2*m*f + n*e)/area
    root = sqrt(max(mean**2 - (l*n - m**2)/area, 0.0_wp))
    k = mean - root      ! negative where the surface falls away from the sheet
    if (.not. k < 0.0_wp) return
    bend%radius = -1.0_wp/k
    v = [m - k*f, k*e - l]
    if (sum(abs([n - k*g, k*f - m])) > sum(abs(v))) v = [n - k*g, k*f - m]
    bend%direction = matmul(d1, v)
    if (norm2(bend%direction) > 0.0_wp) then
      bend%direction = bend%direction/norm2(bend%direction)
    else
      bend%direction = d1(:, 1)/sqrt(e)   ! it bends equally in all directions
    end if
  end function bend_at

  !> Break of the tangent at a position of an edge between two faces.
  pure function bend_across(tool, face, edge, fraction) result(bend)
    type(tool_t), intent(in) :: tool
    integer, intent(in) :: face, edge        !! s = 0, s = 1, t = 0, t = 1
    real(wp), intent(in) :: fraction            !! fraction of its length
    type(bend_t) :: bend
    real(wp) :: here(3, 2), there(3, 2), d2(3, 3), normals(3, 2), along(3), outwards(3), x(3)
    real(wp) :: along_here, along_there
    integer :: other, other_edge, direction

    bend%radius = huge(1.0_wp)
    along_here = fraction
    along_there = fraction
    other = tool%neighbours(edge, face)
    other_edge = merge(edge + 1, edge - 1, mod(edge, 2) == 1)
    if (other < 0) then
      associate (seam => tool%links(-other))
        along_here = (1.0_wp - fraction)*seam%here(1) + fraction*seam%here(2)
        along_there = (1.0_wp - fraction)*seam%there(1) + fraction*seam%there(2)
        other_edge = seam%edge
        other = seam%face
      end associate
      if (other == 0) return
    end if
    call face_derivatives(tool%coefficients, face, edge_position(edge, along_here), bend%x, here, &
                          d2)
    call face_derivatives(tool%coefficients, other, edge_position(other_edge, along_there), x, &
                          there, d2)
    normals(:, 1) = tool%side*unit_normal(here)
    normals(:, 2) = tool%side*unit_normal(there)
    if (sum(normals(:, 1)*normals(:, 2)) > cos(sharp)) return
    if (minval(sum(normals**2, 1)) < 0.5_wp) return
    direction = merge(1, 2, edge <= 2)
    along = here(:, 3 - direction)
    outwards = here(:, direction)*merge(-1, 1, mod(edge, 2) == 1)
    ! Beyond the edge the tool falls away from the plane of this face.
    if (norm2(along) <= 0.0_wp .or. sum(normals(:, 2)*outwards) <= 0.0_wp) return
    bend%radius = 0.0_wp
    bend%normal = sum(normals, 2)/norm2(sum(normals, 2))
    bend%direction = cross(along/norm2(along), normals(:, 1))
  end function bend_across

end module tool_bends
