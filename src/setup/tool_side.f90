!> The side of a tool whose *TOOL does not say it: that on which the blank lies.
module tool_side
  use kinds, only: wp
  use failure, only: error_t
  use scene, only: blank_spec_t
  use nurbs_surface, only: nurbs_surface_t
  use refinement, only: reverse_axis
  use surface_seams, only: surface_seams_t, find_surface_seams, orient_surfaces
  use tool, only: tool_t, new_tool, seam_tolerance
  use closest_point, only: hit_t, is_beside
  use tool_search, only: search_all_faces
  implicit none
  private

  public :: face_the_blank

  integer, parameter :: most_points = 300     !! of the blank that are looked at

contains

  !> Turn the surfaces of a tool so that side +1 of each connected group faces the blank, and give
  !! the side: -1 where all groups are the other way round, which leaves them as they are. A group
  !! that the blank is on both sides of, or beside, stays as it is.
  subroutine face_the_blank(blank, surfaces, search_distance, side)
    type(blank_spec_t), intent(in) :: blank
    type(nurbs_surface_t), intent(inout) :: surfaces(:)   !! where they start
    real(wp), intent(in) :: search_distance               !! [length]
    integer, intent(out) :: side
    type(surface_seams_t) :: seams
    real(wp), allocatable :: x(:, :)
    integer, allocatable :: sides(:)
    integer :: g, i

    side = 1
    call find_surface_seams(surfaces, seam_tolerance(search_distance), seams)
    if (seams%is_one_sided) return
    x = points_of(blank)
    allocate (sides(maxval(seams%group)))
    do g = 1, size(sides)
      sides(g) = side_of(surfaces, seams, g, search_distance, x)
    end do
    if (all(sides < 0)) then
      side = -1
    else if (any(sides < 0)) then
      call orient_surfaces(seams, surfaces)
      do i = 1, size(surfaces)
        if (sides(seams%group(i)) < 0) call reverse_axis(surfaces(i), 1)
      end do
    end if
  end subroutine face_the_blank

  !> Side of one group: -1 where the blank nearest to it lies behind it, else +1.
  integer function side_of(surfaces, seams, group, search_distance, x) result(side)
    type(nurbs_surface_t), intent(in) :: surfaces(:)
    type(surface_seams_t), intent(in) :: seams
    integer, intent(in) :: group
    real(wp), intent(in) :: search_distance
    real(wp), intent(in) :: x(:, :)           !! points of the blank, shape (3, n)
    real(wp), parameter :: nothing = 1.0e-6_wp
    type(tool_t) :: tool
    type(error_t), allocatable :: error
    type(hit_t) :: hits(size(x, 2))
    logical :: is_near(size(x, 2))
    integer :: i

    side = 1
    call new_tool(tool, "", pack_of(surfaces, seams%group == group), 1, search_distance, error)
    if (allocated(error)) return
    do i = 1, size(hits)
      call search_all_faces(tool, x(:, i), hits(i))
      if (is_beside(tool, hits(i), 0.0_wp)) hits(i)%distance = huge(1.0_wp)
    end do
    if (minval(hits%distance) >= huge(1.0_wp)) return
    is_near = hits%distance <= minval(hits%distance) + search_distance
    ! Points that touch the tool say nothing.
    if (maxval(hits%gap, is_near) < nothing*search_distance .and. &
        minval(hits%gap, is_near) < -nothing*search_distance) side = -1
  end function side_of

  pure function pack_of(surfaces, mask) result(chosen)
    type(nurbs_surface_t), intent(in) :: surfaces(:)
    logical, intent(in) :: mask(:)
    type(nurbs_surface_t) :: chosen(count(mask))
    integer :: i, n

    n = 0
    do i = 1, size(mask)
      if (.not. mask(i)) cycle
      n = n + 1
      chosen(n) = surfaces(i)
    end do
  end function pack_of

  !> Control points of the two large faces, of many every n-th.
  pure function points_of(blank) result(x)
    type(blank_spec_t), intent(in) :: blank
    real(wp), allocatable :: x(:, :)
    real(wp), allocatable :: all_points(:, :)
    integer :: p, layer, every

    allocate (all_points(3, 0))
    do p = 1, size(blank%patches)
      associate (points => blank%patches(p)%solid%points)
        do layer = 1, size(points, 3), max(size(points, 3) - 1, 1)
          all_points = reshape([all_points, transpose(reshape(points(:, :, layer, :), &
                                [size(points, 1)*size(points, 2), 3]))], &
                               [3, size(all_points, 2) + size(points, 1)*size(points, 2)])
        end do
      end associate
    end do
    every = (size(all_points, 2) + most_points - 1)/most_points
    x = all_points(:, ::every)
  end function points_of

end module tool_side
