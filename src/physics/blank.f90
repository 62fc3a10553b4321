!> The deformable blank: patches joined at seams, and the law of their material.
module blank
  use, intrinsic :: iso_fortran_env, only: int64
  use kinds, only: wp
  use failure, only: error_t
  use parcel, only: parcel_t
  use ranks, only: traffic_t
  use nurbs_solid, only: nurbs_solid_t
  use scene, only: patch_spec_t
  use patch_seams, only: seams_t, no_seams, find_seams, column_mask_t, whole_columns
  use block_law, only: block_law_t
  use strain_projection, only: projection_spec_t
  use shell_setup, only: mid_surface
  use shell_joints, only: shell_joints_t
  use joint_setup, only: new_shell_joints
  use element, only: part_t, force_report_t
  use body_parts, only: set_inertia
  use element_kinds, only: new_part
  use tool, only: tool_t
  implicit none
  private

  public :: blank_t, new_blank, face_slice
  public :: n_elements_of, last_element_number, n_controls_of, mass_of, columns_of

  !> All patches with their motion.
  type :: blank_t
    character(:), allocatable :: name
    type(part_t), allocatable :: parts(:)
    type(seams_t) :: seams
    type(shell_joints_t) :: joints          !! of shells that pass moments
    class(block_law_t), allocatable :: law
    real(wp) :: mass_factor = 1.0_wp        !! by which scaling has raised all masses
    real(wp) :: added_mass = 0.0_wp         !! by all scaling
    type(force_report_t) :: report          !! of the last force evaluation
    !> What passes between processes that move but some of the rows of control points.
    type(parcel_t), allocatable :: sent(:), received(:)
    type(traffic_t) :: traffic
    integer(int64) :: n_exchanges = 0       !! of increments
  end type blank_t

  !> What effects act on.
  type, public :: assembly_t
    type(blank_t) :: blank
    type(tool_t), allocatable :: tools(:)
  end type assembly_t

contains

  !> A blank at rest and without stress. `law` is taken over. Seams are found here, on the grids
  !! that the run has, so that nothing done to a scene before leaves them behind.
  subroutine new_blank(blank, name, patches, law, viscosity, error, merge_distance, projection, &
                       is_shell, has_hinges)
    type(blank_t), intent(out) :: blank
    character(*), intent(in) :: name
    type(patch_spec_t), intent(in) :: patches(:)
    class(block_law_t), allocatable, intent(inout) :: law
    real(wp), intent(in) :: viscosity(2)                !! linear and quadratic factor
    type(error_t), allocatable, intent(out) :: error
    real(wp), intent(in), optional :: merge_distance    !! of `find_seams`; absent or < 0: none
    type(projection_spec_t), intent(in), optional :: projection   !! absent: none
    logical, intent(in), optional :: is_shell           !! mid-surfaces; absent: solids
    logical, intent(in), optional :: has_hinges         !! joints of shells pass no moment
    type(nurbs_solid_t) :: solids(size(patches))
    logical :: are_hinges
    integer :: p

    blank%name = name
    blank%seams = no_seams(size(patches))
    do p = 1, size(patches)
      solids(p) = patches(p)%solid
    end do
    if (present(merge_distance)) then
      if (merge_distance >= 0.0_wp) then
        call find_seams(solids, merge_distance, blank%seams)
        if (present(is_shell)) then
          if (is_shell) call find_seams_of_shells(solids, merge_distance, blank%seams)
        end if
      end if
    end if
    allocate (blank%parts(size(patches)))
    do p = 1, size(patches)
      associate (spec => patches(p))
        call new_part(blank%parts(p), spec%name, solids(p), spec%n_points, spec%n_parts, &
                            law, viscosity, error, projection, is_shell)
        if (allocated(error)) return
      end associate
      blank%parts(p)%element%n_before = last_element_number(blank%parts(:p - 1))
    end do
    call set_inertia(blank%parts, blank%seams)
    if (present(is_shell)) then
      if (is_shell) then
        are_hinges = .false.
        if (present(has_hinges)) are_hinges = has_hinges
        call new_shell_joints(blank%parts, solids, blank%seams, are_hinges, blank%joints)
      end if
    end if
    call move_alloc(law, blank%law)
  end subroutine new_blank

  !> Seams by the control points of mid-surfaces, whose solids meet exactly by now.
  pure subroutine find_seams_of_shells(solids, merge_distance, seams)
    type(nurbs_solid_t), intent(in) :: solids(:)
    real(wp), intent(in) :: merge_distance              !! [length]
    type(seams_t), intent(out) :: seams
    type(nurbs_solid_t) :: middle(size(solids))
    integer :: p

    do p = 1, size(solids)
      middle(p) = mid_surface(solids(p))
    end do
    call find_seams(middle, merge_distance, seams)
  end subroutine find_seams_of_shells

  !> Elements of all patches, without those outside of outlines.
  pure integer function n_elements_of(parts) result(n)
    type(part_t), intent(in) :: parts(:)
    integer :: p

    n = 0
    do p = 1, size(parts)
      n = n + product(parts(p)%element%n_elements)
      if (allocated(parts(p)%element%ties%share)) &
        n = n - count(parts(p)%element%ties%share <= 0.0_wp)*parts(p)%element%n_elements(3)
    end do
  end function n_elements_of

  !> Elements are numbered through all patches; an outline leaves elements out, not their numbers.
  pure integer function last_element_number(parts) result(n)
    type(part_t), intent(in) :: parts(:)
    integer :: p

    n = sum([(product(parts(p)%element%n_elements), p=1, size(parts))])
  end function last_element_number

  !> Control points of all patches, those at seams as often as patches meet there.
  pure integer function n_controls_of(parts) result(n)
    type(part_t), intent(in) :: parts(:)
    integer :: p

    n = sum([(size(parts(p)%element%grid%weights), p=1, size(parts))])
  end function n_controls_of

  !> Mass of all patches.
  pure real(wp) function mass_of(parts) result(mass)
    type(part_t), intent(in) :: parts(:)
    integer :: p

    mass = sum([(sum(parts(p)%element%mass), p=1, size(parts))])
  end function mass_of

  !> Columns through the thickness that seams leave whole, by patch.
  pure function columns_of(blank) result(is_whole)
    type(blank_t), intent(in) :: blank
    type(column_mask_t), allocatable :: is_whole(:)
    integer :: p

    is_whole = whole_columns(blank%seams, reshape([(blank%parts(p)%element%grid%axes%n_basis, &
                                                    p=1, size(blank%parts))], &
                                                  [3, size(blank%parts)]))
  end function columns_of

  !> Bounds (lower, upper) of the control indices of a face: 1 xi_min, 2 xi_max, ... 6 zeta_max.
  pure function face_slice(n, face) result(bounds)
    integer, intent(in) :: n(3), face
    integer :: bounds(3, 2), axis

    axis = (face + 1)/2
    bounds(:, 1) = 1
    bounds(:, 2) = n
    bounds(axis, :) = merge(1, n(axis), mod(face, 2) == 1)
  end function face_slice

end module blank
