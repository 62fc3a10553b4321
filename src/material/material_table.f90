!> The table of constitutive laws: from the name and constants of a deck to a block law.
module material_table
  use kinds, only: wp
  use failure, only: error_t, fail
  use block_law, only: block_law_t
  use elastic, only: new_elastic
  use neo_hooke, only: new_neo_hooke
  use law_spec, only: law_spec_t
  use constant_check, only: check_count
  use plastic_laws, only: new_plastic
  implicit none
  private

  public :: new_law

contains

  !> The law that a deck asks for, with its constants checked.
  !!
  !! Refused: unknown names, constants that are not finite, too many or too few of them, density
  !! or stiffness not positive, Poisson's ratio outside (-1, 0.5), hardening constants that give
  !! a yield stress that is not positive or that falls.
  subroutine new_law(spec, law, error)
    type(law_spec_t), intent(in) :: spec
    class(block_law_t), allocatable, intent(out) :: law
    type(error_t), allocatable, intent(out) :: error

    call check_elastic(spec%density, spec%young, spec%poisson, error)
    if (allocated(error)) return
    select case (spec%law)
    case ("ELASTIC")
      call check_count("the law ELASTIC", spec%constants, 0, "no constants of its own", error)
      if (.not. allocated(error)) &
        allocate (law, source=new_elastic(spec%density, spec%young, spec%poisson))
    case ("NEO HOOKE")
      call check_count("the law NEO HOOKE", spec%constants, 0, "no constants of its own", error)
      if (.not. allocated(error)) &
        allocate (law, source=new_neo_hooke(spec%density, spec%young, spec%poisson))
    case ("PLASTIC")
      call new_plastic(spec, law, error)
    case default
      call fail(error, "material: unknown law "//trim(spec%law)// &
                ", known are ELASTIC, NEO HOOKE and PLASTIC")
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

end module material_table
