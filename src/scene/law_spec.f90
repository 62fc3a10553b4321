!> What a deck says about a constitutive law, as plain data for `material_table`.
module law_spec
  use kinds, only: wp
  implicit none
  private

  !> One of several flow curves of a material.
  type, public :: rate_curve_spec_t
    real(wp) :: rate = 0.0_wp                  !! plastic strain rate at which it holds [1/time]
    real(wp), allocatable :: points(:)         !! stress and plastic strain in turn
  end type rate_curve_spec_t

  !> Plasticity: names as the deck writes them, "" meaning that the deck names none.
  type, public :: plasticity_spec_t
    character(16) :: hardening = ""            !! as in *PLASTIC, ISOTROPIC being TABLE
    character(16) :: rate = ""                 !! COWPER SYMONDS or JOHNSON COOK
    real(wp), allocatable :: rate_constants(:) !! D, p, or C, reference rate
    type(rate_curve_spec_t), allocatable :: rate_curves(:)   !! of *PLASTIC, RATE=, if several
    logical :: is_logarithmic = .false.        !! interpolation between their rates
    integer :: n_stages = 0                    !! of the multi-stage return, 0: backward Euler
    real(wp), allocatable :: back_stresses(:)  !! pairs C [stress], gamma
    real(wp), allocatable :: heating(:)        !! share, specific heat, temperatures, exponent
    real(wp), allocatable :: damage(:)         !! a, b, c, n of *DAMAGE INITIATION
    real(wp), allocatable :: unloading(:)      !! E_a [stress], xi: modulus after plastic strain
    character(16) :: potential = ""            !! TYPE of *POTENTIAL; "": von Mises
    real(wp), allocatable :: coefficients(:)   !! of the yield function
    real(wp), allocatable :: orientation(:)    !! vectors a and b, axes of the material
  end type plasticity_spec_t

  !> A law with its density, elastic constants and constants of its own.
  type, public :: law_spec_t
    character(16) :: law = "ELASTIC"           !! ELASTIC, NEO HOOKE, PLASTIC; UMAT, VUMAT or USER
    real(wp) :: density = 0.0_wp               !! [mass/length^3]
    real(wp) :: young = 0.0_wp                 !! Young's modulus [stress]
    real(wp) :: poisson = 0.0_wp               !! Poisson's ratio
    real(wp), allocatable :: constants(:)      !! PLASTIC: of the hardening; UMAT: its PROPS
    integer :: n_state = 0                     !! UMAT: number of STATEV
    type(plasticity_spec_t) :: plasticity = plasticity_spec_t()   !! of PLASTIC; heating: UMAT too
    character(:), allocatable :: name          !! of the material
    character(3) :: thread_safe = ""           !! UMAT: YES, NO or "": what the files look like
    integer :: n_uvarm = 0                     !! UMAT: output variables of a UVARM
    logical :: has_own_fields = .false.        !! UMAT: field variables are set by a USDFLD
    logical :: is_small = .false.              !! UMAT: without deformation gradients
    logical :: is_of_solids = .false.          !! UMAT: has no form for shells
    logical :: is_sheet = .false.              !! its points are in plane stress
  end type law_spec_t

end module law_spec
