!> Contact of a sheet with a wavy tool of any number of faces, all points touching or none.
module contact_case
  use kinds, only: wp
  use failure, only: error_t, fail
  use knot_vector, only: new_knot_vector, greville
  use nurbs_surface, only: nurbs_surface_t, evaluate_surface
  use tool, only: tool_t, new_tool
  use slave_surface, only: slave_surface_t, new_slave_surface, points_gauss
  use contact, only: contact_t, contact_options_t, new_contact, apply_contact
  use closest_point, only: hit_t
  use tool_search, only: search_tool
  use bench_case, only: bench_case_t
  implicit none
  private

  public :: wavy_surface

  real(wp), parameter :: reach = 9.0_wp              !! search distance: three thicknesses [mm]
  real(wp), parameter :: movement = 0.05_wp          !! of the sheet, a step [mm]

  !> Steps of a sheet that slides to and fro over the tool.
  type, extends(bench_case_t), public :: contact_case_t
    integer :: n_faces(2) = [22, 12]           !! of the tool
    real(wp) :: edge = 1000.0_wp               !! of the tool; the sheet's is half of it [mm]
    integer :: n_sheet(2) = 33                 !! elements of the sheet, 9 slave points each
    real(wp) :: height = -0.3_wp               !! of the sheet above the tool's middle [mm]
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
    type(slave_surface_t) :: slave
    type(contact_options_t) :: options
    real(wp), allocatable :: mass(:, :)

    call wavy_surface(surface, self%n_faces, self%edge, 0.0_wp, 0.1_wp, error)
    if (allocated(error)) return
    call new_tool(self%tool, "wavy tool", [surface], 1, reach, error)
    if (allocated(error)) return
    call wavy_surface(sheet, self%n_sheet, 0.5_wp*self%edge, self%height, 0.0_wp, error)
    if (allocated(error)) return
    call new_slave_surface(slave, sheet, points_gauss, [0, 0], error)
    if (allocated(error)) return
    allocate (mass(slave%n_net(1), slave%n_net(2)), source=1.0_wp)
    call new_contact(self%pair, slave, self%tool, mass, 1.0_wp, options, error)
    if (allocated(error)) return
    allocate (self%net(slave%n_net(1), slave%n_net(2), 3, 2))
    self%net(:, :, :, 1) = sheet%points
    self%net(:, :, :, 2) = sheet%points
    self%net(:, :, 1, 2) = self%net(:, :, 1, 2) + movement
    allocate (self%force(slave%n_net(1), slave%n_net(2), 3))
    self%n_units = real(self%n_calls, wp)*slave%n_points
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

    expected = merge(self%pair%slave%n_points, 0, self%height < 0.0_wp)
    if (self%pair%statistics%n_touching /= expected) then
      call fail(error, self%name//": not as many points touch as should")
    else if (self%pair%statistics%n_failures > 0) then
      call fail(error, self%name//": some searches failed")
    end if
  end subroutine check_contact

  !> Points near the tool in rows, as slave points lie.
  subroutine prepare_search(self, error)
    class(search_case_t), intent(inout) :: self
    type(error_t), allocatable, intent(out) :: error
    real(wp), parameter :: spacing = 3.3_wp   ! [mm]
    integer, parameter :: n_row = 50
    type(nurbs_surface_t) :: surface
    real(wp) :: xi(2), place(3)
    integer :: i

    call wavy_surface(surface, self%n_faces, self%edge, 0.0_wp, 0.1_wp, error)
    if (allocated(error)) return
    call new_tool(self%tool, "wavy tool", [surface], 1, reach, error)
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

end module contact_case
