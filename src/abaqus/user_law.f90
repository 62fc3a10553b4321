!> From a loaded library of a user and the constants of a deck to a block law.
module user_law
  use, intrinsic :: iso_c_binding, only: c_associated, c_f_procpointer, c_null_funptr, c_null_ptr
  use kinds, only: wp
  use failure, only: error_t, fail
  use text, only: joined
  use law_spec, only: law_spec_t
  use block_law, only: block_law_t, set_elastic
  use material_table, only: check_elastic
  use user_library, only: user_library_t
  use user_call, only: umat_procedure, vumat_procedure, sdvini_procedure, user_law_t, &
                       usdfld_procedure, vusdfld_procedure, uvarm_procedure, set_user_fields, &
                       set_user_heating, first_point_t, call_sdvini, watch_user_calls, &
                       uneven_stiffness, moduli_of, plane_moduli_of, set_user_sheet
  use umat_adapter, only: umat_adapter_t, new_umat_adapter
  use vumat_adapter, only: new_vumat_adapter
  implicit none
  private

  public :: new_user_law, lacks_moduli, find_moduli, needs_more, set_initial_state
  public :: first_point_t

contains

  !> A law that calls the user's UMAT or VUMAT. Its moduli for the stable time increment are those
  !! of the deck or, where the deck has none, zero until `find_moduli` asks the law itself. Fails
  !! where there is none of that kind, or where density or moduli are out of range.
  subroutine new_user_law(library, material, n_fields, law, note, error)
    type(user_library_t), intent(in) :: library
    class(law_spec_t), intent(in) :: material
    integer, intent(in) :: n_fields                  !! field variables of the deck
    class(block_law_t), allocatable, intent(out) :: law
    character(:), allocatable, intent(out) :: note   !! worth telling the user, or empty
    type(error_t), allocatable, intent(out) :: error
    class(user_law_t), allocatable :: made
    logical :: is_vumat

    note = ""
    call check_elastic(material%density, merge(material%young, 1.0_wp, material%young > 0.0_wp), &
                       material%poisson, error)
    if (allocated(error)) return
    is_vumat = material%law == "VUMAT" .or. &
               (material%law /= "UMAT" .and. .not. c_associated(library%umat))
    if (is_vumat .and. .not. c_associated(library%vumat)) then
      call fail(error, "material: no SUBROUTINE VUMAT in "//joined(library%files, ", "))
    else if (.not. is_vumat .and. .not. c_associated(library%umat)) then
      call fail(error, "material: no SUBROUTINE UMAT in "//joined(library%files, ", ")// &
                "; for its VUMAT the deck needs TYPE=VUMAT")
    else if (is_vumat .and. material%is_small) then
      call fail(error, "material: KINEMATICS=SMALL with the VUMAT of "// &
                joined(library%files, ", ")//", whose frame follows from deformation gradients")
    end if
    if (allocated(error)) return
    call check_companions(library, material, is_vumat, error)
    if (allocated(error)) return
    call watch_user_calls(c_null_funptr, c_null_ptr)
    call make_law(library, material, is_vumat, made)
    call add_companions(library, material, n_fields, is_vumat, made)
    if (material%is_sheet) call set_user_sheet(made)
    if (allocated(material%plasticity%heating)) &
      call set_user_heating(made, material%plasticity%heating(:3))
    call move_alloc(made, law)
    if (material%young > 0.0_wp) &
      call set_elastic(law, material%density, material%young, material%poisson)
    law%is_serial = material%thread_safe == "NO"
    if (material%thread_safe == "" .and. library%writable /= "") then
      law%is_serial = .true.
      note = "data shared between threads ("//library%writable//") in the user subroutine, "// &
             "which therefore runs on one thread, in the order of the elements"
    end if
  end subroutine new_user_law

  !> The adapter of the UMAT or VUMAT of a library.
  subroutine make_law(library, material, is_vumat, law)
    type(user_library_t), intent(in) :: library
    class(law_spec_t), intent(in) :: material
    logical, intent(in) :: is_vumat
    class(user_law_t), allocatable, intent(out) :: law
    procedure(umat_procedure), pointer :: umat
    procedure(vumat_procedure), pointer :: vumat
    procedure(sdvini_procedure), pointer :: sdvini

    associate (m => material)
      if (is_vumat) then
        call c_f_procpointer(library%vumat, vumat)
        allocate (law, source=new_vumat_adapter(vumat, m%name, m%density, m%constants, m%n_state, &
                                                m%is_sheet .and. .not. m%is_of_solids))
      else
        call c_f_procpointer(library%umat, umat)
        allocate (law, source=new_umat_adapter(umat, m%name, m%density, m%constants, m%n_state, &
                                               m%is_sheet .and. .not. m%is_of_solids))
      end if
      if (c_associated(library%sdvini)) then
        call c_f_procpointer(library%sdvini, sdvini)
        law%sdvini => sdvini
      end if
      law%has_moduli = m%young > 0.0_wp
      law%needs_gradients = .not. m%is_small
    end associate
  end subroutine make_law

  !> Fails where the deck names a subroutine for fields or output that the files do not have.
  subroutine check_companions(library, material, is_vumat, error)
    type(user_library_t), intent(in) :: library
    class(law_spec_t), intent(in) :: material
    logical, intent(in) :: is_vumat
    type(error_t), allocatable, intent(out) :: error
    character(:), allocatable :: missing

    missing = ""
    if (material%n_uvarm > 0 .and. .not. c_associated(library%uvarm)) &
      missing = "UVARM, which *USER OUTPUT VARIABLES asks for,"
    if (material%has_own_fields) then
      if (is_vumat .and. .not. c_associated(library%vusdfld)) then
        missing = "VUSDFLD, which *USER DEFINED FIELD asks for with a VUMAT,"
      else if (.not. is_vumat .and. .not. c_associated(library%usdfld)) then
        missing = "USDFLD, which *USER DEFINED FIELD asks for with a UMAT,"
      end if
    end if
    if (missing /= "") call fail(error, "material: no SUBROUTINE "//missing//" in "// &
                                 joined(library%files, ", "))
  end subroutine check_companions

  !> The subroutines for fields and output that the deck names.
  subroutine add_companions(library, material, n_fields, is_vumat, law)
    type(user_library_t), intent(in) :: library
    class(law_spec_t), intent(in) :: material
    integer, intent(in) :: n_fields
    logical, intent(in) :: is_vumat
    class(user_law_t), intent(inout) :: law
    procedure(usdfld_procedure), pointer :: usdfld
    procedure(vusdfld_procedure), pointer :: vusdfld
    procedure(uvarm_procedure), pointer :: uvarm

    call set_user_fields(law, material%n_uvarm, merge(max(1, n_fields), 0, material%has_own_fields))
    if (material%n_uvarm > 0) then
      call c_f_procpointer(library%uvarm, uvarm)
      law%uvarm => uvarm
    end if
    if (material%has_own_fields .and. is_vumat) then
      call c_f_procpointer(library%vusdfld, vusdfld)
      law%vusdfld => vusdfld
    else if (material%has_own_fields) then
      call c_f_procpointer(library%usdfld, usdfld)
      law%usdfld => usdfld
    end if
  end subroutine add_companions

  !> Must this law be asked for its moduli by `find_moduli`?
  pure logical function lacks_moduli(law)
    class(block_law_t), intent(in) :: law

    lacks_moduli = .false.
    select type (law)
    class is (user_law_t)
      lacks_moduli = .not. (law%bulk > 0.0_wp .and. law%shear > 0.0_wp)
    end select
  end function lacks_moduli

  !> Elastic moduli for the stable time increment from one call of the user's subroutine for a point
  !! as it is at the start. Fails where they are not available: a law that leaves out components is
  !! one for shells or for plane problems.
  subroutine find_moduli(law, dt, point, state, bulk, shear, error)
    class(block_law_t), intent(in) :: law
    real(wp), intent(in) :: dt               !! a short increment
    type(first_point_t), intent(in) :: point
    real(wp), intent(in) :: state(:)         !! all that the law keeps for the point
    real(wp), intent(out) :: bulk, shear
    type(error_t), allocatable, intent(out) :: error
    character(:), allocatable :: source, words
    real(wp) :: stiffness(6)
    logical :: is_finite

    bulk = law%bulk
    shear = law%shear
    select type (law)
    class is (user_law_t)
      call law%stiffness_at_start(dt, point, state(:law%n_statv), stiffness, is_finite)
      if (law%is_plane) then
        call plane_moduli_of(stiffness, bulk, shear)
      else
        call moduli_of(stiffness, bulk, shear)
      end if
      source = trim(law%stiffness_source)
      if (.not. is_finite) then
        call fail(error, "material: the first call of the user's subroutine returns values "// &
                  "that are NaN or infinite, looking for "//source)
      else if (uneven_stiffness(stiffness > 0.0_wp) /= "") then
        call fail(error, "material: "//source//" is "//uneven_stiffness(stiffness > 0.0_wp))
      else if (.not. shear > 0.0_wp) then
        words = " is not positive"
        if (law%is_plane .and. all(stiffness > 0.0_wp)) words = " is not that of plane stress "// &
          "(its components for 11 and 12 give no Poisson's ratio from -1 to 0.5)"
        call fail(error, "material: "//source//words//", so the stable time "// &
                  "increment is not known; an *ELASTIC together with *USER MATERIAL gives it")
      end if
    end select
  end subroutine find_moduli

  !> Does a law to which the deck gives no deformation gradients use them all the same? It is called
  !! for a point at the start to see that.
  logical function needs_more(law, dt, point, state)
    class(block_law_t), intent(in) :: law
    real(wp), intent(in) :: dt               !! a short increment
    type(first_point_t), intent(in) :: point
    real(wp), intent(in) :: state(:)         !! all that the law keeps for the point

    needs_more = .false.
    if (law%needs_gradients) return
    select type (law)
    type is (umat_adapter_t)
      needs_more = law%differs_without_gradients(dt, point, state(:law%n_statv))
    end select
  end function needs_more

  !> State variables of a point at the start: the user's SDVINI may change what the deck gives.
  !! Other laws are left alone.
  subroutine set_initial_state(law, element, point, place, state)
    class(block_law_t), intent(in) :: law
    integer, intent(in) :: element                 !! number, from 1
    integer, intent(in) :: point(2)                !! in its layer, and the layer
    real(wp), intent(in) :: place(3)
    real(wp), intent(inout) :: state(:)            !! all that the law keeps for the point

    select type (law)
    class is (user_law_t)
      call call_sdvini(law, element, point, place, state(:law%n_statv))
    end select
  end subroutine set_initial_state

end module user_law
