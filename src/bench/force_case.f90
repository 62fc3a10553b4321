!> The force routine on a blank whose points are all in the same regime.
module force_case
  use kinds, only: wp
  use failure, only: error_t, fail
  use nurbs_solid, only: nurbs_solid_t
  use primitives, only: box_solid
  use block_law, only: block_law_t
  use element, only: part_t, force_report_t
  use element_kinds, only: new_part, reduce_to_plane
  use solid_element, only: solid_element_t
  use strain_projection, only: projection_spec_t, project_nothing
  use bench_case, only: bench_case_t
  use bench_laws, only: new_bench_law
  use force_cost, only: kernel_flops, law_flops, force_bytes
  use memory_cost, only: memory_ratio
  implicit none
  private

  !> Strain grows by 1e-4 a call, less for laws that shall stay elastic; positions stay as they are.
  type, extends(bench_case_t), public :: force_case_t
    integer :: degrees(3) = 2
    integer :: points(3) = 2, parts(3) = 1     !! Gauss points a part, parts an element
    integer :: n_elements(3) = [80, 32, 1]
    character(16) :: law_name = "voce"
    logical :: is_rational = .false., is_viscous = .true.
    logical :: is_strip = .false.              !! in plane strain: uniform and held along y
    type(projection_spec_t) :: projection
    class(solid_element_t), allocatable :: element
    class(block_law_t), allocatable :: law
    real(wp), allocatable, dimension(:, :, :, :, :) :: stress, state   !! before each repetition
    type(force_report_t) :: report
    integer :: n_calls = 1
  contains
    procedure :: prepare
    procedure :: run
    procedure :: restore
    procedure :: check
  end type force_case_t

  real(wp), parameter :: dt = 1.0e-7_wp        !! [s]
  integer, parameter :: n_warm = 60            !! calls before the first repetition

contains

  !> Build the blank and load it until its points flow.
  subroutine prepare(self, error)
    class(force_case_t), intent(inout) :: self
    type(error_t), allocatable, intent(out) :: error
    type(nurbs_solid_t) :: solid
    type(part_t) :: part
    real(wp) :: viscosity(2)

    call new_bench_law(trim(self%law_name), self%law, error)
    if (allocated(error)) return
    call bent_sheet(self, solid, error)
    if (allocated(error)) return
    viscosity = merge([0.06_wp, 1.2_wp], 0.0_wp, self%is_viscous)
    call new_part(part, self%name, solid, self%points, self%parts, self%law, viscosity, error, &
                  self%projection)
    if (allocated(error)) return
    if (self%is_strip) call reduce_to_plane(part, self%law, 2)
    if (self%is_strip .and. index(part%element%kernel_name(), "plane_strain") == 0) then
      call fail(error, self%name//": no kernel of plane strain")
      return
    end if
    select type (element => part%element)
    class is (solid_element_t)
      allocate (self%element, source=element)
    end select
    call set_velocities(self)
    call set_counts(self)
    self%n_calls = n_warm
    call self%run()
    self%n_calls = max(1, 4000/product(self%n_elements))
    self%n_units = real(self%n_calls, wp)*product(self%n_elements)
    self%stress = self%element%patch%stress
    self%state = self%element%patch%state
  end subroutine prepare

  !> Elements of 10 x 10 x 3 mm, a little bent so that no two are alike.
  subroutine bent_sheet(self, solid, error)
    class(force_case_t), intent(in) :: self
    type(nurbs_solid_t), intent(out) :: solid
    type(error_t), allocatable, intent(out) :: error
    real(wp), parameter :: edges(3) = [10.0_wp, 10.0_wp, 3.0_wp]
    integer :: i, j

    call box_solid(solid, [0.0_wp, 0.0_wp, 0.0_wp], edges*self%n_elements, self%degrees, &
                   self%n_elements, [1.0_wp, 1.0_wp, 1.0_wp], [1, 2, 3], error)
    if (allocated(error)) return
    do j = 1, size(solid%weights, 2)
      do i = 1, size(solid%weights, 1)
        solid%points(i, j, :, 3) = solid%points(i, j, :, 3) &
                                   + 0.3_wp*sin(0.7_wp*i + merge(0.0_wp, 1.1_wp, self%is_strip)*j)
        if (self%is_rational) solid%weights(i, j, :) = 1.0_wp + 0.1_wp*sin(1.3_wp*i + 0.6_wp*j)
      end do
    end do
  end subroutine bent_sheet

  !> A velocity gradient without change of volume, so that the pressure does not grow.
  subroutine set_velocities(self)
    class(force_case_t), intent(inout) :: self
    real(wp), parameter :: whole(3, 3) = reshape([1.0_wp, -0.1_wp, 0.0_wp, &
                                                  0.3_wp, -0.5_wp, 0.1_wp, &
                                                  0.0_wp, 0.2_wp, -0.5_wp], [3, 3])
    real(wp), parameter :: plane(3, 3) = reshape([1.0_wp, 0.0_wp, 0.3_wp, &
                                                  0.0_wp, 0.0_wp, 0.0_wp, &
                                                  0.0_wp, 0.0_wp, -1.0_wp], [3, 3])
    real(wp) :: rate, shape(3, 3)
    integer :: c

    shape = merge(plane, whole, self%is_strip)
    rate = 1.0e-4_wp/dt
    if (self%law_name == "voce_elastic") rate = 1.0e-9_wp/dt
    associate (x => self%element%motion%x, v => self%element%motion%v)
      do c = 1, 3
        v(:, :, :, c) = rate*(shape(c, 1)*x(:, :, :, 1) + shape(c, 2)*x(:, :, :, 2) &
                              + shape(c, 3)*x(:, :, :, 3))
      end do
    end associate
  end subroutine set_velocities

  !> Operations and bytes an element, where those of the law are known.
  subroutine set_counts(self)
    class(force_case_t), intent(inout) :: self
    integer :: q(3), n_elements
    real(wp) :: controls

    q = self%element%rule%n
    n_elements = product(self%n_elements)
    controls = real(size(self%element%mass), wp)/n_elements
    self%n_points = product(q)
    self%memory_ratio = memory_ratio(self%element%patch, self%element%buffers, &
                                     size(self%element%motion%x))
    self%bytes = force_bytes(self%n_points, self%law%n_state, controls, self%is_rational)
    self%working_set = n_elements*(8.0_wp*self%n_points*(6 + self%law%n_state) + 72.0_wp*controls)
    if (self%is_rational) self%working_set = self%working_set + 40.0_wp*self%n_points*n_elements
    if (self%projection%kind /= project_nothing .or. self%is_strip) return
    if (.not. law_flops(trim(self%law_name)) > 0.0_wp) return
    self%flops = kernel_flops(self%degrees, q, self%is_rational, self%is_viscous) &
                 + self%n_points*law_flops(trim(self%law_name))
  end subroutine set_counts

  !> Force evaluations one after the other.
  subroutine run(self)
    class(force_case_t), intent(inout) :: self
    integer :: i

    do i = 1, self%n_calls
      call self%element%forces(self%law, dt, self%report)
    end do
  end subroutine run

  !> Stress and state as after the loading.
  subroutine restore(self)
    class(force_case_t), intent(inout) :: self

    self%element%patch%stress = self%stress
    self%element%patch%state = self%state
  end subroutine restore

  !> Did every point flow, or none, as the name says?
  subroutine check(self, error)
    class(force_case_t), intent(in) :: self
    type(error_t), allocatable, intent(out) :: error
    real(wp) :: least, most
    integer :: e

    if (self%report%failed_block < huge(1)) then
      call fail(error, self%name//": the law failed")
      return
    end if
    e = self%law%eqps_state
    if (e == 0) return
    associate (growth => self%element%patch%state(:, :, e, :, :) - self%state(:, :, e, :, :))
      least = minval(growth)
      most = maxval(growth)
    end associate
    if (self%law_name == "voce_elastic") then
      if (most > 0.0_wp) call fail(error, self%name//": some points flow")
    else if (.not. least > 0.0_wp) then
      call fail(error, self%name//": some points do not flow")
    end if
  end subroutine check

end module force_case
