!> Contact of a sheet with a wavy tool of any number of faces, all points touching or none; search
!! on that tool; and closest points on the lower die of the channel.
module contact_case
  use kinds, only: wp
  use failure, only: error_t, fail
  use text, only: string_t
  use input_errors, only: error_list_t, n_errors
  use scene, only: scene_t
  use deck_reader, only: read_deck
  use knot_vector, only: new_knot_vector, greville
  use nurbs_surface, only: nurbs_surface_t, evaluate_surface
  use tool, only: tool_t, new_tool
  use secondary_surface, only: secondary_surface_t, new_secondary_surface, points_gauss
  use contact, only: contact_t, contact_options_t, new_contact, apply_contact
  use closest_point, only: hit_t, lanes_t, follow_lanes, n_lanes
  use tool_search, only: search_tool
  use bench_case, only: bench_case_t
  use cut_dies, only: cut_pieces
  use bench_paths, only: project_folder
  implicit none
  private

  integer, parameter :: n_rows = 8, n_along = 512    !! points across and along the die's profile
  real(wp), parameter :: reach = 9.0_wp              !! search distance: three thicknesses [mm]
  real(wp), parameter :: depth = 0.02_wp             !! of points in the die [mm]
  real(wp), parameter :: edge_wave = 0.14_wp         !! of the edges of pieces, of their size

  !> Steps of a sheet that slides to and fro over the tool.
  type, extends(bench_case_t), public :: contact_case_t
    integer :: n_faces(2) = [22, 12]           !! of the tool
    integer :: n_pieces(2) = 0                 !! into which it is cut along waves, 0: whole
    real(wp) :: edge = 1000.0_wp               !! of the tool; the sheet's is half of it [mm]
    integer :: n_sheet(2) = 33                 !! elements of the sheet, 9 secondary points each
    real(wp) :: height = -0.3_wp               !! of the sheet above the tool's middle [mm]
    real(wp) :: movement = 0.05_wp             !! of a point, a step [mm]
    integer :: n_calls = 36                    !! steps: a search anew falls due in about as many
    type(tool_t) :: tool
    type(contact_t) :: pair
    real(wp), allocatable :: net(:, :, :, :), force(:, :, :)
    real(wp) :: energy = 0.0_wp, depth = 0.0_wp
  contains
    procedure :: prepare => prepare_contact
    procedure :: run => run_contact
    procedure :: check => check_contact
  end type contact_case_t

  !> Searches without knowledge of where the point was.
  type, extends(bench_case_t), public :: search_case_t
    integer :: n_faces(2) = [22, 12]
    real(wp) :: edge = 1000.0_wp
    integer :: n_searches = 2000
    type(tool_t) :: tool
    real(wp), allocatable :: x(:, :)           !! points, shape (3, n_searches)
    integer :: n_found = 0
  contains
    procedure :: prepare => prepare_search
    procedure :: run => run_search
    procedure :: check => check_search
  end type search_case_t

  !> Eight points at a time that moved a little since their closest points were found.
  type, extends(bench_case_t), public :: die_case_t
    type(tool_t) :: tool
    real(wp) :: movement = 0.05_wp             !! of a point [mm]
    type(lanes_t), allocatable :: before(:)          !! where they were, and where they are now
    integer :: n_good = 0
  contains
    procedure :: prepare => prepare_die
    procedure :: run => run_die
    procedure :: check => check_die
  end type die_case_t

contains

  !> Quadratic surface over a square about the origin, its normal xi x eta along z.
  subroutine wavy_surface(surface, n_faces, edge, height, wave, error)
    type(nurbs_surface_t), intent(out) :: surface
    integer, intent(in) :: n_faces(2)
    real(wp), intent(in) :: edge, height, wave       !! [length]
    type(error_t), allocatable, intent(out) :: error
    integer :: i, j, d

    do d = 1, 2
      call new_knot_vector(surface%axes(d), 2, [0.0_wp, 0.0_wp, &
        (real(i, wp)/n_faces(d), i=0, n_faces(d)), 1.0_wp, 1.0_wp], error)
      if (allocated(error)) return
    end do
    allocate (surface%points(surface%axes(1)%n_basis, surface%axes(2)%n_basis, 3))
    allocate (surface%weights(surface%axes(1)%n_basis, surface%axes(2)%n_basis), source=1.0_wp)
    associate (xi => greville(surface%axes(1)), eta => greville(surface%axes(2)))
      do j = 1, size(eta)
        do i = 1, size(xi)
          surface%points(i, j, :) = [edge*(xi(i) - 0.5_wp), edge*(eta(j) - 0.5_wp), &
                                     height + wave*sin(20*xi(i) + 15*eta(j))]
        end do
      end do
    end associate
  end subroutine wavy_surface

  !> Tool, sheet and the two places of the sheet between which it slides.
  subroutine prepare_contact(self, error)
    class(contact_case_t), intent(inout) :: self
    type(error_t), allocatable, intent(out) :: error
    type(nurbs_surface_t) :: surface, sheet
    type(nurbs_surface_t), allocatable :: surfaces(:)
    type(secondary_surface_t) :: secondary
    type(contact_options_t) :: options
    real(wp), allocatable :: mass(:, :)

    call wavy_surface(surface, self%n_faces, self%edge, 0.0_wp, 0.1_wp, error)
    if (allocated(error)) return
    if (all(self%n_pieces > 0)) then
      call cut_pieces(surface, self%n_pieces, edge_wave, surfaces, error)
      if (allocated(error)) return
    else
      allocate (surfaces(1), source=surface)
    end if
    call new_tool(self%tool, "wavy tool", surfaces, 1, reach, error)
    if (allocated(error)) return
    call wavy_surface(sheet, self%n_sheet, 0.5_wp*self%edge, self%height, 0.0_wp, error)
    if (.not. allocated(error)) &
      call new_secondary_surface(secondary, sheet, points_gauss, [3, 3], error)
    if (allocated(error)) return
    allocate (mass(secondary%n_net(1), secondary%n_net(2)), source=1.0_wp)
    call new_contact(self%pair, secondary, self%tool, mass, 1.0_wp, options, error)
    if (allocated(error)) return
    allocate (self%net(secondary%n_net(1), secondary%n_net(2), 3, 2))
    self%net(:, :, :, 1) = sheet%points
    self%net(:, :, :, 2) = sheet%points
    self%net(:, :, 1, 2) = self%net(:, :, 1, 2) + self%movement
    allocate (self%force(secondary%n_net(1), secondary%n_net(2), 3))
    self%n_units = real(self%n_calls, wp)*secondary%n_points
  end subroutine prepare_contact

  subroutine run_contact(self)
    class(contact_case_t), intent(inout) :: self
    integer :: i

    do i = 1, self%n_calls
      self%force = 0.0_wp
      self%tool%force = 0.0_wp
      call apply_contact(self%pair, self%tool, self%net(:, :, :, 1 + mod(i, 2)), self%force, &
                         self%energy, self%depth, 1.0_wp)
    end do
  end subroutine run_contact

  !> Did all points touch, or none, and did every search succeed?
  subroutine check_contact(self, error)
    class(contact_case_t), intent(in) :: self
    type(error_t), allocatable, intent(out) :: error
    integer :: expected

    expected = merge(self%pair%secondary%n_points, 0, self%height < 0.0_wp)
    if (self%pair%statistics%n_touching /= expected) then
      call fail(error, self%name//": not as many points touch as should")
    else if (self%pair%statistics%n_failures > 0) then
      call fail(error, self%name//": some searches failed")
    end if
  end subroutine check_contact

  !> Points near the tool in rows, as secondary points lie.
  subroutine prepare_search(self, error)
    class(search_case_t), intent(inout) :: self
    type(error_t), allocatable, intent(out) :: error
    real(wp), parameter :: spacing = 3.3_wp   ! [mm]
    integer, parameter :: n_row = 50
    type(nurbs_surface_t) :: surface
    real(wp) :: xi(2), place(3)
    integer :: i

    call wavy_surface(surface, self%n_faces, self%edge, 0.0_wp, 0.1_wp, error)
    if (.not. allocated(error)) call new_tool(self%tool, "wavy tool", [surface], 1, reach, error)
    if (allocated(error)) return
    allocate (self%x(3, self%n_searches))
    do i = 1, self%n_searches
      xi = 0.3_wp + spacing/self%edge*[mod(i - 1, n_row), (i - 1)/n_row]
      call evaluate_surface(surface, modulo(xi, 1.0_wp), place)
      self%x(:, i) = place + [0.0_wp, 0.0_wp, 2.0_wp*sin(1.0_wp*i)]
    end do
    self%n_units = real(self%n_searches, wp)
  end subroutine prepare_search

  subroutine run_search(self)
    class(search_case_t), intent(inout) :: self
    type(hit_t) :: hit
    integer :: i, n_found

    n_found = 0
    !$omp parallel do schedule(static) private(hit) reduction(+:n_found)
    do i = 1, self%n_searches
      call search_tool(self%tool, self%x(:, i), 0.0_wp, .false., hit)
      if (hit%face > 0) n_found = n_found + 1
    end do
    !$omp end parallel do
    self%n_found = n_found
  end subroutine run_search

  subroutine check_search(self, error)
    class(search_case_t), intent(in) :: self
    type(error_t), allocatable, intent(out) :: error

    if (self%n_found < self%n_searches) call fail(error, self%name//": some points were not found")
  end subroutine check_search

  !> Find where the points are on the die, then move them along it.
  subroutine prepare_die(self, error)
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
                           (j - 0.5_wp)/n_rows], self%movement, self%before(n/n_lanes + 1), &
                           mod(n, n_lanes) + 1)
          n = n + 1
        end do
      end do
    end associate
    self%n_units = real(n, wp)
  end subroutine prepare_die

  !> One point: below the surface at these parameters, found, then moved along the first tangent.
  subroutine place_point(tool, surface, at, movement, lanes, lane)
    type(tool_t), intent(in) :: tool
    type(nurbs_surface_t), intent(in) :: surface
    real(wp), intent(in) :: at(2)              !! shares of the parameter ranges
    real(wp), intent(in) :: movement           !! [mm]
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

  subroutine run_die(self)
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
  end subroutine run_die

  !> Nearly all points must settle: the others would be searched one by one.
  subroutine check_die(self, error)
    class(die_case_t), intent(in) :: self
    type(error_t), allocatable, intent(out) :: error

    if (self%n_good < 0.9_wp*self%n_units) then
      call fail(error, self%name//": too few points settle")
    end if
  end subroutine check_die

end module contact_case
