!> The force routine on a blank whose points are all in the same regime, for the laws of steel made
!! the way decks make theirs.
module force_case
  use kinds, only: wp
  use failure, only: error_t, fail
  use nurbs_solid, only: nurbs_solid_t
  use primitives, only: box_solid
  use text, only: string_t, upper_case
  use state_store, only: state_store_t, empty_store
  use block_law, only: block_law_t
  use law_spec, only: law_spec_t
  use material_table, only: new_law
  use user_library, only: user_library_t, load_user_library
  use user_law, only: new_user_law
  use element, only: part_t, force_report_t
  use element_kinds, only: new_part, reduce_to_plane
  use strain_projection, only: projection_spec_t, project_nothing
  use bench_case, only: bench_case_t
  use bench_paths, only: project_folder
  use force_cost, only: kernel_flops, law_flops, force_bytes
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
    logical :: is_shell = .false.              !! its positions follow the velocities
    type(projection_spec_t) :: projection
    type(part_t) :: part
    class(block_law_t), allocatable :: law
    type(state_store_t) :: loaded              !! motion, stress and state before each repetition
    real(wp), allocatable :: strain(:)         !! equivalent plastic, at the points there
    type(force_report_t) :: report
    integer :: n_calls = 1
  contains
    procedure :: prepare
    procedure :: run
    procedure :: restore
    procedure :: check
  end type force_case_t

  real(wp), parameter :: density = 7.85e-9_wp, young = 210000.0_wp, poisson = 0.3_wp   ! t, mm, s
  real(wp), parameter :: flow(3) = [250.0_wp, 250.0_wp, 6.0_wp]
  real(wp), parameter :: rolling_direction(6) = [1.0_wp, 0.0_wp, 0.0_wp, 0.0_wp, 1.0_wp, 0.0_wp]
  !> Sheet 2090-T3 of F. Barlat et al., Int. J. Plasticity 21 (2005), table 2.
  real(wp), parameter :: al_2090(19) = [ &
    -0.069888_wp, 0.936408_wp, 0.079143_wp, 1.003060_wp, 0.524741_wp, 1.363180_wp, &
    1.023770_wp, 1.069060_wp, 0.954322_wp, 0.981171_wp, 0.476741_wp, 0.575316_wp, 0.866827_wp, &
    1.145010_wp, -0.079294_wp, 1.051660_wp, 1.147100_wp, 1.404620_wp, 8.0_wp]
  !> The same sheet, F. Barlat et al., Int. J. Plasticity 19 (2003), table 3, first row.
  real(wp), parameter :: plane_2090(9) = [0.4865_wp, 1.3783_wp, 0.7536_wp, 1.0246_wp, 1.0363_wp, &
                                          0.9036_wp, 1.2321_wp, 1.4858_wp, 8.0_wp]
  real(wp), parameter, public :: dt = 1.0e-7_wp   !! [s]
  integer, parameter :: n_warm = 60            !! calls before the first repetition

contains

  !> Build the blank and load it until its points flow.
  subroutine prepare(self, error)
    class(force_case_t), intent(inout) :: self
    type(error_t), allocatable, intent(out) :: error
    type(nurbs_solid_t) :: solid
    real(wp) :: viscosity(2)

    call new_bench_law(trim(self%law_name), self%is_shell, self%law, error)
    if (allocated(error)) return
    call bent_sheet(self, solid, error)
    if (allocated(error)) return
    viscosity = merge([0.06_wp, 1.2_wp], 0.0_wp, self%is_viscous)
    call new_part(self%part, self%name, solid, self%points, self%parts, self%law, viscosity, &
                  error, self%projection, self%is_shell)
    if (allocated(error)) return
    if (self%is_strip) call reduce_to_plane(self%part, self%law, 2)
    if (self%is_strip .and. index(self%part%element%kernel_name(), "plane_strain") == 0) then
      call fail(error, self%name//": no kernel of plane strain")
      return
    end if
    call set_velocities(self)
    call set_counts(self)
    self%n_calls = n_warm
    call self%run()
    self%n_calls = max(1, 4000/product(self%n_elements))
    self%n_units = real(self%n_calls, wp)*product(self%n_elements)
    call empty_store(self%loaded)
    call self%part%element%carry(self%loaded)
    self%loaded%is_taking = .true.
    self%strain = plastic_strain(self)
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
    associate (x => self%part%element%motion%x, v => self%part%element%motion%v)
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

    q = self%part%element%rule%n
    n_elements = product(self%n_elements)
    controls = real(size(self%part%element%mass), wp)/n_elements
    self%n_points = product(q)
    ! Memory that the element holds over stress and state of its points and positions and
    ! velocities of its control points.
    associate (element => self%part%element)
      self%memory_ratio = element%n_stored()/(real(self%n_points*n_elements, wp) &
        *(6 + max(1, self%law%n_state)) + 2.0_wp*size(element%motion%x))
    end associate
    self%bytes = force_bytes(self%n_points, self%law%n_state, controls, self%is_rational)
    self%working_set = n_elements*(8.0_wp*self%n_points*(6 + self%law%n_state) + 72.0_wp*controls)
    if (self%is_rational) self%working_set = self%working_set + 40.0_wp*self%n_points*n_elements
    if (self%projection%kind /= project_nothing .or. self%is_strip .or. self%is_shell) return
    if (.not. law_flops(trim(self%law_name)) > 0.0_wp) return
    self%flops = kernel_flops(self%degrees, q, self%is_rational, self%is_viscous) &
                 + self%n_points*law_flops(trim(self%law_name))
  end subroutine set_counts

  !> Force evaluations one after the other.
  subroutine run(self)
    class(force_case_t), intent(inout) :: self
    integer :: i

    do i = 1, self%n_calls
      associate (motion => self%part%element%motion)
        if (self%is_shell) motion%x = motion%x + dt*motion%v
      end associate
      call self%part%element%forces(self%law, dt, self%report)
    end do
  end subroutine run

  !> Stress and state as after the loading.
  subroutine restore(self)
    class(force_case_t), intent(inout) :: self

    call self%part%element%carry(self%loaded)
  end subroutine restore

  !> Did every point flow, or none, as the name says?
  subroutine check(self, error)
    class(force_case_t), intent(in) :: self
    type(error_t), allocatable, intent(out) :: error
    real(wp), allocatable :: growth(:)

    if (self%report%failed_block < huge(1)) then
      call fail(error, self%name//": the law failed")
      return
    end if
    if (self%law%eqps_state == 0) return
    growth = plastic_strain(self) - self%strain
    if (self%law_name == "voce_elastic") then
      if (any(growth > 0.0_wp)) call fail(error, self%name//": some points flow")
    else if (.not. all(growth > 0.0_wp)) then
      call fail(error, self%name//": some points do not flow")
    end if
  end subroutine check

  !> Equivalent plastic strain of all points.
  function plastic_strain(self) result(strain)
    class(force_case_t), intent(in) :: self
    real(wp), allocatable :: strain(:)
    real(wp), allocatable, dimension(:, :, :, :, :, :) :: eqps
    real(wp), allocatable, dimension(:, :, :, :, :, :, :) :: nothing

    associate (q => self%part%element%rule%n, n => self%part%element%n_elements)
      allocate (eqps(q(1), q(2), q(3), n(1), n(2), n(3)), source=0.0_wp)
      allocate (nothing(0, q(1), q(2), q(3), n(1), n(2), n(3)))
    end associate
    call self%part%element%read_points(self%law%eqps_state, eqps, nothing, nothing)
    strain = [eqps]
  end function plastic_strain

  !> Law by its name in the names of records. Fails where a user's subroutine cannot be compiled.
  subroutine new_bench_law(name, is_sheet, law, error)
    character(*), intent(in) :: name
    logical, intent(in) :: is_sheet      !! for shells
    class(block_law_t), allocatable, intent(out) :: law
    type(error_t), allocatable, intent(out) :: error
    type(law_spec_t) :: spec
    integer :: i

    spec%is_sheet = is_sheet
    spec%density = density
    spec%young = young
    spec%poisson = poisson
    spec%law = "PLASTIC"
    spec%plasticity%hardening = "VOCE"
    spec%constants = flow
    select case (name)
    case ("umat_small")
      spec%is_small = .true.
      call new_user("umat_voce", spec, law, error)
      return
    case ("umat_voce", "vumat_voce")
      call new_user(name, spec, law, error)
      return
    case ("elastic", "neo_hooke")
      spec%law = merge("ELASTIC  ", "NEO HOOKE", name == "elastic")
      spec%constants = [real(wp) ::]
    case ("swift")
      spec%plasticity%hardening = "SWIFT"
      spec%constants = [600.0_wp, 0.005_wp, 0.2_wp]
    case ("ludwik")
      spec%plasticity%hardening = "LUDWIK"
      spec%constants = [250.0_wp, 500.0_wp, 0.4_wp]
    case ("table")
      spec%plasticity%hardening = "TABLE"
      spec%constants = [(250.0_wp + 250.0_wp*(1.0_wp - exp(-0.3_wp*i)), 0.05_wp*i, i=0, 15)]
    case ("cowper")
      spec%plasticity%rate = "COWPER SYMONDS"
      spec%plasticity%rate_constants = [40.0_wp, 5.0_wp]
    case ("johnson")
      spec%plasticity%rate = "JOHNSON COOK"
      spec%plasticity%rate_constants = [0.014_wp, 1.0_wp]
    case ("stages")
      spec%plasticity%n_stages = 5
    case ("chaboche")
      spec%plasticity%back_stresses = [20000.0_wp, 200.0_wp, 2000.0_wp, 20.0_wp]
    case ("yoshida")
      spec%plasticity%hardening = "YOSHIDA UEMORI"
      spec%plasticity%unloading = [0.74_wp*young, 30.8_wp]
      spec%constants = [124.0_wp, 168.0_wp, 500.0_wp, 12.0_wp, 9.0_wp, 0.5_wp, 190.0_wp]
    case ("hill48")
      spec%plasticity%potential = "HILL48"
      spec%plasticity%coefficients = [1.8_wp, 1.5_wp, 2.2_wp]
      spec%plasticity%orientation = rolling_direction
    case ("yld91")
      spec%plasticity%potential = "YLD91"
      spec%plasticity%coefficients = [1.05_wp, 0.98_wp, 1.02_wp, 1.0_wp, 1.0_wp, 1.0_wp, 6.0_wp]
      spec%plasticity%orientation = rolling_direction
    case ("yld2004")
      spec%plasticity%potential = "YLD2004"
      spec%plasticity%coefficients = al_2090
      spec%plasticity%orientation = rolling_direction
    case ("barlat89")
      spec%plasticity%potential = "BARLAT89"
      spec%plasticity%coefficients = [1.8_wp, 1.5_wp, 2.2_wp, 6.0_wp]
      spec%plasticity%orientation = rolling_direction
    case ("yld2000")
      spec%plasticity%potential = "YLD2000"
      spec%plasticity%coefficients = plane_2090
      spec%plasticity%orientation = rolling_direction
    end select
    call new_law(spec, law, error)
  end subroutine new_bench_law

  !> Von Mises with Voce hardening as a user's subroutine.
  subroutine new_user(name, spec, law, error)
    character(*), intent(in) :: name               !! of the example in the folder input
    type(law_spec_t), intent(inout) :: spec
    class(block_law_t), allocatable, intent(out) :: law
    type(error_t), allocatable, intent(out) :: error
    type(user_library_t) :: library
    type(string_t) :: files(1)
    character(:), allocatable :: note

    files(1)%value = project_folder()//"/input/"//name//".f"
    call load_user_library(files, files(:0), .true., library, error)
    if (allocated(error)) return
    spec%name = "steel"
    spec%law = upper_case(name(:index(name, "_") - 1))
    spec%thread_safe = "YES"
    spec%constants = [young, poisson, flow]
    spec%n_state = 1
    call new_user_law(library, spec, 0, law, note, error)
    if (.not. allocated(error)) law%eqps_state = 1
  end subroutine new_user

end module force_case
