!> The table of constitutive laws: from the name and constants of a deck to a block law.
module material_table
  use kinds, only: wp
  use failure, only: error_t, fail
  use text, only: string_t, append_text, joined
  use block_law, only: block_law_t, law_entry_t
  use elastic, only: elastic_law
  use neo_hooke, only: neo_hooke_law
  use plastic_laws, only: plastic_law
  use law_spec, only: law_spec_t
  use constant_check, only: check_count
  implicit none
  private

  public :: new_law, known_laws

contains

  !> All laws of the program: a new one is one line here and a file of its own.
  function known_laws() result(laws)
    type(law_entry_t), allocatable :: laws(:)

    laws = [elastic_law(), &
            neo_hooke_law(), &
            plastic_law()]
  end function known_laws

  !> The law that a deck asks for, with its constants checked.
  !!
  !! Rejected: unknown names, constants that are not finite, too many or too few of them, density
  !! or stiffness not positive, Poisson's ratio outside (-1, 0.5), hardening constants that give
  !! a yield stress that is not positive or that falls.
  subroutine new_law(spec, law, error, laws)
    type(law_spec_t), intent(in) :: spec
    class(block_law_t), allocatable, intent(out) :: law
    type(error_t), allocatable, intent(out) :: error
    type(law_entry_t), intent(in), optional :: laws(:)   !! to choose from; absent: `known_laws`

    type(law_entry_t), allocatable :: table(:)
    type(string_t), allocatable :: names(:)
    integer :: i

    call check_elastic(spec%density, spec%young, spec%poisson, error)
    if (allocated(error)) return
    if (present(laws)) then
      table = laws
    else
      table = known_laws()
    end if
    allocate (names(0))
    do i = 1, size(table)
      call append_text(names, trim(table(i)%name))
      if (table(i)%name /= spec%law) cycle
      if (table(i)%n_constants >= 0) &
        call check_count("the law "//spec%law, spec%constants, table(i)%n_constants, &
                         trim(table(i)%constants), error)
      if (.not. allocated(error)) call table(i)%build(spec, law, error)
      return
    end do
    call fail(error, "material: unknown law "//trim(spec%law)//"; known laws: "// &
              joined(names, ", "))
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
