!> Closest points of eight points at a time on the lower die of the channel, warm-started.
module die_case
  use kinds, only: wp
  use failure, only: error_t, fail
  use text, only: string_t
  use input_errors, only: error_list_t, n_errors
  use scene, only: scene_t
  use deck_reader, only: read_deck
  use nurbs_surface, only: nurbs_surface_t, evaluate_surface
  use tool, only: tool_t, new_tool
  use closest_point, only: hit_t
  use tool_search, only: search_tool
  use closest_point_lanes, only: lanes_t, follow_lanes, n_lanes
  use bench_case, only: bench_case_t
  use bench_paths, only: project_folder
  implicit none
  private

  integer, parameter :: n_rows = 8, n_along = 512    !! points across and along the profile
  real(wp), parameter :: movement = 0.05_wp          !! since the last step [mm]
  real(wp), parameter :: depth = 0.02_wp             !! in the die [mm]

  !> Points that moved a little since their closest points were found.
  type, extends(bench_case_t), public :: die_case_t
    type(tool_t) :: tool
    type(lanes_t), allocatable :: before(:)          !! where they were, and where they are now
    integer :: n_good = 0
  contains
    procedure :: prepare
    procedure :: run
    procedure :: check
  end type die_case_t

contains

  !> Find where the points are on the die, then move them along it.
  subroutine prepare(self, error)
    class(die_case_t), intent(inout) :: self
    type(error_t), allocatable, intent(out) :: error
    type(string_t) :: no_overrides(0)
    type(scene_t) :: scene
    type(error_list_t) :: errors
    integer :: i, j, n

    call read_deck(project_folder()//"/input/channel_forming.key", no_overrides, scene, errors)
    if (n_errors(errors) > 0) then
      call fail(error, self%name//": input/channel_forming.key cannot be read")
      return
    end if
    associate (spec => scene%tools(1))
      call new_tool(self%tool, spec%name, spec%surfaces, spec%side, 9.0_wp, error)
      if (allocated(error)) return
      allocate (self%before(n_rows*n_along/n_lanes))
      n = 0
      do j = 1, n_rows
        do i = 1, n_along
          call place_point(self%tool, spec%surfaces(1), [(i - 0.5_wp)/n_along, &
                           (j - 0.5_wp)/n_rows], self%before(n/n_lanes + 1), mod(n, n_lanes) + 1)
          n = n + 1
        end do
      end do
    end associate
    self%n_units = real(n, wp)
  end subroutine prepare

  !> One point: below the surface at these parameters, found, then moved along the first tangent.
  subroutine place_point(tool, surface, at, lanes, lane)
    type(tool_t), intent(in) :: tool
    type(nurbs_surface_t), intent(in) :: surface
    real(wp), intent(in) :: at(2)              !! shares of the parameter ranges
    type(lanes_t), intent(inout) :: lanes
    integer, intent(in) :: lane
    type(hit_t) :: hit
    real(wp) :: xi(2), place(3), slopes(3, 2)
    integer :: d

    do d = 1, 2
      associate (knots => surface%axes(d)%knots)
        xi(d) = knots(1) + at(d)*(knots(size(knots)) - knots(1))
      end associate
    end do
    call evaluate_surface(surface, xi, place, slopes)
    call search_tool(tool, place, 0.0_wp, .false., hit)
    lanes%face(lane) = hit%face
    lanes%s(lane) = hit%at(1)
    lanes%t(lane) = hit%at(2)
    lanes%x(lane, :) = place - depth*hit%normal + movement*slopes(:, 1)/norm2(slopes(:, 1))
  end subroutine place_point

  subroutine run(self)
    class(die_case_t), intent(inout) :: self
    type(lanes_t) :: lanes
    integer :: i, n_good

    n_good = 0
    !$omp parallel do schedule(static) private(lanes) reduction(+:n_good)
    do i = 1, size(self%before)
      lanes = self%before(i)
      call follow_lanes(self%tool, lanes)
      n_good = n_good + count(lanes%is_good)
    end do
    !$omp end parallel do
    self%n_good = n_good
  end subroutine run

  !> Nearly all points must settle: the others would be searched one by one.
  subroutine check(self, error)
    class(die_case_t), intent(in) :: self
    type(error_t), allocatable, intent(out) :: error

    if (self%n_good < 0.9_wp*self%n_units) then
      call fail(error, self%name//": too few points settle")
    end if
  end subroutine check

end module die_case
