!> The laws that the benchmark measures: steel, made the way decks make theirs.
module bench_laws
  use kinds, only: wp
  use failure, only: error_t
  use text, only: string_t
  use block_law, only: block_law_t
  use law_spec, only: law_spec_t
  use material_table, only: new_law
  use user_library, only: user_library_t, load_user_library
  use user_law, only: user_material_t, new_user_law
  use bench_paths, only: project_folder
  implicit none
  private

  public :: new_bench_law

  real(wp), parameter :: density = 7.85e-9_wp, young = 210000.0_wp, poisson = 0.3_wp   ! t, mm, s
  real(wp), parameter :: flow(3) = [250.0_wp, 250.0_wp, 6.0_wp]
  real(wp), parameter :: rolling_direction(6) = [1.0_wp, 0.0_wp, 0.0_wp, 0.0_wp, 1.0_wp, 0.0_wp]

contains

  !> Law by its name in the names of records. Fails where a user's subroutine cannot be compiled.
  subroutine new_bench_law(name, law, error)
    character(*), intent(in) :: name
    class(block_law_t), allocatable, intent(out) :: law
    type(error_t), allocatable, intent(out) :: error
    type(law_spec_t) :: spec

    select case (name)
    case ("umat_voce")
      call new_user("UMAT", project_folder()//"/input/umat_voce.f", law, error)
      return
    case ("vumat_voce")
      call new_user("VUMAT", project_folder()//"/input/vumat_voce.f", law, error)
      return
    case ("elastic", "neo_hooke")
      spec%law = "ELASTIC"
      if (name == "neo_hooke") spec%law = "NEO HOOKE"
      allocate (spec%constants(0))
    case default
      spec%law = "PLASTIC"
      spec%plasticity%hardening = "VOCE"
      spec%constants = flow
    end select
    spec%density = density
    spec%young = young
    spec%poisson = poisson
    call set_variant(name, spec)
    call new_law(spec, law, error)
  end subroutine new_bench_law

  !> What differs from von Mises with Voce hardening.
  subroutine set_variant(name, spec)
    character(*), intent(in) :: name
    type(law_spec_t), intent(inout) :: spec

    select case (name)
    case ("swift")
      spec%plasticity%hardening = "SWIFT"
      spec%constants = [600.0_wp, 0.005_wp, 0.2_wp]
    case ("chaboche")
      spec%plasticity%back_stresses = [20000.0_wp, 200.0_wp, 2000.0_wp, 20.0_wp]
    case ("hill48")
      spec%plasticity%potential = "HILL48"
      spec%plasticity%coefficients = [1.8_wp, 1.5_wp, 2.2_wp]
      spec%plasticity%orientation = rolling_direction
    case ("yld91")
      spec%plasticity%potential = "YLD91"
      spec%plasticity%coefficients = [1.05_wp, 0.98_wp, 1.02_wp, 1.0_wp, 1.0_wp, 1.0_wp, 6.0_wp]
      spec%plasticity%orientation = rolling_direction
    end select
  end subroutine set_variant

  !> Von Mises with Voce hardening as a user's subroutine.
  subroutine new_user(kind, file, law, error)
    character(*), intent(in) :: kind, file
    class(block_law_t), allocatable, intent(out) :: law
    type(error_t), allocatable, intent(out) :: error
    type(user_library_t) :: library
    type(user_material_t) :: material
    type(string_t) :: files(1)
    character(:), allocatable :: note

    files(1)%value = file
    call load_user_library(files, .true., library, error)
    if (allocated(error)) return
    material%name = "steel"
    material%kind = kind
    material%thread_safe = "YES"
    material%density = density
    material%young = young
    material%poisson = poisson
    material%props = [young, poisson, flow]
    material%n_statv = 1
    call new_user_law(library, material, law, note, error)
    if (.not. allocated(error)) law%eqps_state = 1
  end subroutine new_user

end module bench_laws
