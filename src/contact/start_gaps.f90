!> Questions about blank and tools that the set-up of a model asks, once.
module start_gaps
  use kinds, only: wp
  use tool, only: tool_t
  use secondary_surface, only: secondary_surface_t, secondary_positions
  use closest_point, only: hit_t, is_beside
  use tool_search, only: search_tool, search_all_faces
  implicit none
  private

  public :: initial_gap, face_gaps, sheet_side

contains

  !> Smallest signed gap between secondary points and a tool within its search distance. Negative:
  !! the blank starts inside the tool, deepest at `point`. huge(gap) and point 0 if none is near.
  subroutine initial_gap(secondary, tool, net_x, gap, point, position)
    type(secondary_surface_t), intent(in) :: secondary
    type(tool_t), intent(in) :: tool
    real(wp), intent(in) :: net_x(secondary%n_net(1), secondary%n_net(2), 3)   !! [length]
    real(wp), intent(out) :: gap                                       !! [length]
    integer, intent(out) :: point                                      !! secondary point number
    real(wp), intent(out) :: position(3)                               !! where it is [length]
    real(wp), allocatable :: x(:, :)
    real(wp) :: gaps(secondary%n_points)
    type(hit_t) :: hit
    integer :: i

    allocate (x(secondary%n_points, 3))
    call secondary_positions(secondary, net_x, x)
    !$omp parallel do schedule(dynamic, 64) private(hit)
    do i = 1, secondary%n_points
      call search_tool(tool, x(i, :) - tool%displacement, 0.0_wp, .false., hit)
      gaps(i) = huge(1.0_wp)
      if (secondary%area(i) <= 0.0_wp) cycle   ! outside an outline
      if (hit%face /= 0 .and. .not. is_beside(tool, hit, 0.0_wp)) gaps(i) = hit%gap
    end do
    !$omp end parallel do
    point = minloc(gaps, 1)
    gap = gaps(point)
    position = x(point, :)
    if (gap >= huge(1.0_wp)) point = 0
  end subroutine initial_gap

  !> Signed gap of every secondary point to the nearest point of a tool, however far away. Of two
  !! opposite faces of a blank the one that meets the tool has the smaller mean of proper gaps.
  subroutine face_gaps(secondary, tool, net_x, gaps, is_proper)
    type(secondary_surface_t), intent(in) :: secondary
    type(tool_t), intent(in) :: tool
    real(wp), intent(in) :: net_x(secondary%n_net(1), secondary%n_net(2), 3)   !! [length]
    real(wp), intent(out) :: gaps(secondary%n_points)                      !! [length]
    logical, intent(out) :: is_proper(secondary%n_points) !! the position is not on the tool's edge
    real(wp), allocatable :: x(:, :)
    type(hit_t) :: hit
    integer :: i

    allocate (x(secondary%n_points, 3))
    call secondary_positions(secondary, net_x, x)
    !$omp parallel do schedule(dynamic, 64) private(hit)
    do i = 1, secondary%n_points
      call search_all_faces(tool, x(i, :) - tool%displacement, hit)
      gaps(i) = hit%gap
      is_proper(i) = .not. is_beside(tool, hit, 0.0_wp)
    end do
    !$omp end parallel do
  end subroutine face_gaps

  !> Direction from a tool to points that face it: the mean of the tool's normals at the points
  !! nearest to them, so shorter than 1 where the tool is curved. Zero where no point faces the
  !! tool.
  pure function sheet_side(tool, x) result(direction)
    type(tool_t), intent(in) :: tool
    real(wp), intent(in) :: x(:, :)   !! points, the second axis their coordinates [length]
    real(wp) :: direction(3)
    type(hit_t) :: hit
    integer :: i, n

    direction = 0.0_wp
    n = 0
    do i = 1, size(x, 1)
      call search_all_faces(tool, x(i, :) - tool%displacement, hit)
      if (is_beside(tool, hit, 0.0_wp)) cycle
      n = n + 1
      direction = direction + hit%normal
    end do
    direction = direction/max(n, 1)
  end function sheet_side

end module start_gaps