!> The table of constitutive laws: from the name and constants of a deck to a block law.
module material_table
  use kinds, only: wp
  use errors, only: error_t, fail
  use block_law, only: block_law_t
  use elastic, only: new_elastic
  use voce, only: new_voce
  use umat_adapter, only: new_umat_adapter
  use umat_voce, only: umat
  implicit none
  private

  public :: new_law

contains

  !> The law of this name with its constants checked.
  !!
  !! Refused: unknown names, constants that are not finite, too many or too few of them, density
  !! or stiffness not positive, Poisson's ratio outside (-1, 0.5), hardening constants that give
  !! a yield stress that is not positive or that falls, a UMAT without room for its state.
  subroutine new_law(law_name, density, young, poisson, constants, n_state, law, error)
    character(*), intent(in) :: law_name          !! ELASTIC, VOCE or UMAT
    real(wp), intent(in) :: density               !! [mass/length^3]
    real(wp), intent(in) :: young, poisson        !! [stress], [1]
    real(wp), intent(in) :: constants(:)          !! VOCE: sigma_0, Q, b; UMAT: its PROPS
    integer, intent(in) :: n_state                !! UMAT: number of STATEV; else not used
    class(block_law_t), allocatable, intent(out) :: law
    type(error_t), allocatable, intent(out) :: error

    call check_elastic(density, young, poisson, error)
    if (allocated(error)) return
    select case (law_name)
    case ("ELASTIC")
      call check_count("ELASTIC", constants, 0, "no constants of its own", error)
      if (.not. allocated(error)) allocate (law, source=new_elastic(density, young, poisson))
    case ("VOCE")
      call check_voce("VOCE", constants, error)
      if (.not. allocated(error)) &
        allocate (law, source=new_voce(density, young, poisson, constants(1), constants(2), &
                                       constants(3)))
    case ("UMAT")
      call check_umat(young, poisson, constants, n_state, error)
      if (.not. allocated(error)) &
        allocate (law, source=new_umat_adapter(umat, "UMAT", density, young, poisson, &
                                               constants, n_state))
    case default
      call fail(error, "material: unknown law "//law_name//", known are ELASTIC, VOCE and UMAT")
    end select
  end subroutine new_law

  !> What every law needs for its mass and its stable step. Written so that a NaN is refused.
  pure subroutine check_elastic(density, young, poisson, error)
    real(wp), intent(in) :: density, young, poisson
    type(error_t), allocatable, intent(out) :: error

    if (.not. (density > 0.0_wp .and. density <= huge(density))) then
      call fail(error, "material: the density must be positive")
    else if (.not. (young > 0.0_wp .and. young <= huge(young))) then
      call fail(error, "material: Young's modulus must be positive")
    else if (.not. (poisson > -1.0_wp .and. poisson < 0.5_wp)) then
      call fail(error, "material: Poisson's ratio must lie between -1 and 0.5, both excluded")
    end if
  end subroutine check_elastic

  !> sigma_0, Q, b of the Voce law.
  pure subroutine check_voce(law_name, constants, error)
    character(*), intent(in) :: law_name
    real(wp), intent(in) :: constants(:)
    type(error_t), allocatable, intent(out) :: error

    call check_count(law_name, constants, 3, "three constants: sigma_0, Q, b", error)
    if (allocated(error)) return
    if (constants(1) <= 0.0_wp) then
      call fail(error, "material: the yield stress sigma_0 must be positive")
    else if (constants(2) < 0.0_wp) then
      call fail(error, "material: the hardening Q must not be negative")
    else if (constants(3) < 0.0_wp) then
      call fail(error, "material: the saturation rate b must not be negative")
    end if
  end subroutine check_voce

  !> PROPS of the UMAT that is built in: E, nu, sigma_0, Q, b. The elastic ones must be those of
  !! the material, or its stable step would belong to another law.
  pure subroutine check_umat(young, poisson, constants, n_state, error)
    real(wp), intent(in) :: young, poisson, constants(:)
    integer, intent(in) :: n_state
    type(error_t), allocatable, intent(out) :: error
    real(wp), parameter :: tolerance = 1.0e-9_wp

    call check_count("UMAT", constants, 5, "five constants: E, nu, sigma_0, Q, b", error)
    if (allocated(error)) return
    call check_voce("UMAT", constants(3:), error)
    if (allocated(error)) return
    if (abs(constants(1) - young) > tolerance*young &
        .or. abs(constants(2) - poisson) > tolerance) then
      call fail(error, "material: E and nu of the UMAT differ from those of the material")
    else if (n_state < 1) then
      call fail(error, "material: the UMAT needs one state variable, the plastic strain")
    end if
  end subroutine check_umat

  !> The right number of constants, and all of them finite.
  pure subroutine check_count(law_name, constants, n, expected, error)
    character(*), intent(in) :: law_name, expected
    real(wp), intent(in) :: constants(:)
    integer, intent(in) :: n
    type(error_t), allocatable, intent(out) :: error

    if (size(constants) /= n) then
      call fail(error, "material: the law "//law_name//" takes "//expected)
    else if (.not. all(abs(constants) <= huge(1.0_wp))) then
      call fail(error, "material: the constants must be finite numbers")
    end if
  end subroutine check_count

end module material_table
