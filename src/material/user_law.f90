!> From a loaded library of a user and the constants of a deck to a block law.
module user_law
  use, intrinsic :: iso_c_binding, only: c_associated, c_f_procpointer, c_null_funptr, c_null_ptr
  use kinds, only: wp
  use errors, only: error_t, fail
  use text, only: joined, strings
  use block_law, only: block_law_t
  use umat_interface, only: umat_procedure, vumat_procedure, sdvini_procedure
  use user_library, only: user_library_t
  use user_call, only: user_law_t, call_sdvini, watch_user_calls
  use umat_adapter, only: umat_adapter_t, new_umat_adapter, umat_moduli
  use vumat_adapter, only: vumat_adapter_t, new_vumat_adapter, vumat_moduli
  implicit none
  private

  public :: user_material_t, new_user_law, set_initial_state

  !> What the deck says of a material whose law is a user's.
  type :: user_material_t
    character(:), allocatable :: name          !! CMNAME
    character(:), allocatable :: kind          !! UMAT, VUMAT or empty: what the files have
    character(:), allocatable :: thread_safe   !! YES, NO or empty: what the files look like
    real(wp) :: density = 0.0_wp               !! [mass/length^3]
    real(wp) :: young = 0.0_wp, poisson = 0.0_wp   !! for the stable step; 0: from the law
    real(wp), allocatable :: props(:)
    integer :: n_statv = 0
  end type user_material_t

contains

  !> A law that calls the user's UMAT or VUMAT. Fails where there is none of that kind, where the
  !! density is not positive, or where no elastic moduli are to be had for the stable step.
  subroutine new_user_law(library, material, dt, law, note, error)
    type(user_library_t), intent(in) :: library
    type(user_material_t), intent(in) :: material
    real(wp), intent(in) :: dt                    !! a short increment, for a first call
    class(block_law_t), allocatable, intent(out) :: law
    character(:), allocatable, intent(out) :: note   !! worth telling the user, or empty
    type(error_t), allocatable, intent(out) :: error
    logical :: is_vumat

    note = ""
    if (.not. (material%density > 0.0_wp .and. material%density <= huge(1.0_wp))) then
      call fail(error, "material: the density must be positive")
      return
    end if
    is_vumat = material%kind == "VUMAT" .or. &
               (material%kind /= "UMAT" .and. .not. c_associated(library%umat))
    if (is_vumat .and. .not. c_associated(library%vumat)) then
      call fail(error, "material: no SUBROUTINE VUMAT in "//joined(library%files, ", "))
    else if (.not. is_vumat .and. .not. c_associated(library%umat)) then
      call fail(error, "material: no SUBROUTINE UMAT in "//joined(library%files, ", ")// &
                "; for its VUMAT the deck needs TYPE=VUMAT")
    end if
    if (allocated(error)) return
    call watch_user_calls(c_null_funptr, c_null_ptr)
    if (is_vumat) then
      call make_vumat_law(library, material, dt, law, error)
    else
      call make_umat_law(library, material, dt, law, error)
    end if
    if (allocated(error)) return
    law%is_serial = material%thread_safe == "NO"
    if (material%thread_safe == "" .and. library%writable /= "") then
      law%is_serial = .true.
      note = "data that threads would share ("//library%writable//") in the user subroutine, "// &
             "which therefore runs on one thread, in the order of the elements"
    end if
  end subroutine new_user_law

  subroutine make_umat_law(library, material, dt, law, error)
    type(user_library_t), intent(in) :: library
    type(user_material_t), intent(in) :: material
    real(wp), intent(in) :: dt
    class(block_law_t), allocatable, intent(out) :: law
    type(error_t), allocatable, intent(out) :: error
    procedure(umat_procedure), pointer :: umat
    type(umat_adapter_t) :: adapter
    logical :: is_stiff(6)
    real(wp) :: state(material%n_statv)

    call c_f_procpointer(library%umat, umat)
    adapter = new_umat_adapter(umat, material%name, material%density, 0.0_wp, 0.0_wp, &
                               material%props, material%n_statv)
    call take_sdvini(library, adapter)
    state = 0.0_wp
    call call_sdvini(adapter, 1, 1, [0.0_wp, 0.0_wp, 0.0_wp], state)
    call umat_moduli(adapter, dt, state, adapter%bulk, adapter%shear, is_stiff)
    call check_moduli(material, "DDSDDE at the start", is_stiff, adapter, error)
    if (.not. allocated(error)) allocate (law, source=adapter)
  end subroutine make_umat_law

  subroutine make_vumat_law(library, material, dt, law, error)
    type(user_library_t), intent(in) :: library
    type(user_material_t), intent(in) :: material
    real(wp), intent(in) :: dt
    class(block_law_t), allocatable, intent(out) :: law
    type(error_t), allocatable, intent(out) :: error
    procedure(vumat_procedure), pointer :: vumat
    type(vumat_adapter_t) :: adapter
    logical :: is_stiff(6)
    real(wp) :: state(material%n_statv)

    call c_f_procpointer(library%vumat, vumat)
    adapter = new_vumat_adapter(vumat, material%name, material%density, 0.0_wp, 0.0_wp, &
                                material%props, material%n_statv)
    call take_sdvini(library, adapter)
    state = 0.0_wp
    call call_sdvini(adapter, 1, 1, [0.0_wp, 0.0_wp, 0.0_wp], state)
    call vumat_moduli(adapter, dt, state, adapter%bulk, adapter%shear, is_stiff)
    call check_moduli(material, "the stress of small strains at time 0", is_stiff, adapter, &
                      error)
    if (.not. allocated(error)) allocate (law, source=adapter)
  end subroutine make_vumat_law

  subroutine take_sdvini(library, adapter)
    type(user_library_t), intent(in) :: library
    class(user_law_t), intent(inout) :: adapter
    procedure(sdvini_procedure), pointer :: sdvini

    if (.not. c_associated(library%sdvini)) return
    call c_f_procpointer(library%sdvini, sdvini)
    adapter%sdvini => sdvini
  end subroutine take_sdvini

  !> The moduli that came from the law, or else those of the deck. A law that leaves out components
  !! is one for shells or for plane problems.
  subroutine check_moduli(material, source, is_stiff, law, error)
    type(user_material_t), intent(in) :: material
    character(*), intent(in) :: source
    logical, intent(in) :: is_stiff(6)
    class(user_law_t), intent(inout) :: law
    type(error_t), allocatable, intent(out) :: error
    character(2), parameter :: names(6) = ["11", "22", "33", "12", "13", "23"]

    if (any(is_stiff) .and. .not. all(is_stiff)) then
      call fail(error, "material: "//source//" is positive for the components "// &
                joined(strings(pack(names, is_stiff)), ", ")//" but not for "// &
                joined(strings(pack(names, .not. is_stiff)), ", ")//", as in a law for shells, "// &
                "plane stress or plane strain; sheets are solids here, with NTENS = 6")
      return
    end if
    if (law%bulk > 0.0_wp .and. law%shear > 0.0_wp) return
    if (.not. material%young > 0.0_wp) then
      call fail(error, "material: "//source//" is not positive, so the stable step is not "// &
                "known; an *ELASTIC beside *USER MATERIAL gives it")
    else if (.not. (material%poisson > -1.0_wp .and. material%poisson < 0.5_wp)) then
      call fail(error, "material: Poisson's ratio must lie between -1 and 0.5, both excluded")
    else
      law%bulk = material%young/(3.0_wp*(1.0_wp - 2.0_wp*material%poisson))
      law%shear = material%young/(2.0_wp*(1.0_wp + material%poisson))
    end if
  end subroutine check_moduli

  !> State variables of a point at the start: the user's SDVINI may change what the deck gives.
  !! Other laws are left alone.
  subroutine set_initial_state(law, element, point, place, state)
    class(block_law_t), intent(in) :: law
    integer, intent(in) :: element, point          !! numbers, from 1
    real(wp), intent(in) :: place(3)
    real(wp), intent(inout) :: state(:)            !! all that the law keeps for the point

    select type (law)
    class is (user_law_t)
      call call_sdvini(law, element, point, place, state(:law%n_statv))
    end select
  end subroutine set_initial_state

end module user_law
