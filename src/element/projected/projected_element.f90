!> Solids whose strains are projected against locking, on each element or onto the smooth splines of
!! the patch; and those, also without a projection, whose law asks for the context of its points.
module projected_element
  use kinds, only: wp
  use failure, only: error_t
  use text, only: string_t, to_text, append_text
  use nurbs_solid, only: nurbs_solid_t
  use block_law, only: block_law_t
  use element, only: element_t, force_report_t
  use patch_setup, only: separate_rows
  use solid_element, only: solid_element_t, new_solid_element, cut_out
  use strain_projection, only: projection_t, projection_spec_t, new_projection, projection_name, &
                               project_nothing
  use smooth_splines, only: smooth_fields_t, new_smooth_fields
  use projected_forces, only: forces_of_projection
  use projected_stiffness, only: projected_trial_t, run_projected
  use solid_forces, only: internal_forces
  use solid_stiffness, only: block_trial_t, begin_trial
  use solid_patch, only: block_t
  use smooth_forces, only: forces_of_smooth_projection
  implicit none
  private

  public :: new_projected_element

  !> A solid with a projection, or a law with context.
  type, extends(solid_element_t), public :: projected_element_t
    type(projection_t) :: projection
    type(smooth_fields_t), allocatable :: smooth   !! only where the projection is smooth
  contains
    procedure :: forces
    procedure :: new_trial
    procedure :: try_block
    procedure :: single
    procedure :: describe
  end type projected_element_t

contains

  !> A patch at rest and without stress; its inertia follows when all parts are there.
  subroutine new_projected_element(element, name, grid, n_points, n_parts, law, viscosity, spec, &
                                   error)
    type(projected_element_t), intent(inout) :: element
    character(*), intent(in) :: name
    type(nurbs_solid_t), intent(in) :: grid
    integer, intent(in) :: n_points(3), n_parts(3)      !! quadrature, see `new_patch`
    class(block_law_t), intent(in) :: law
    real(wp), intent(in) :: viscosity(2)                !! linear and quadratic factor
    type(projection_spec_t), intent(in) :: spec
    type(error_t), allocatable, intent(out) :: error

    call new_solid_element(element, name, grid, n_points, n_parts, law, viscosity, error)
    if (allocated(error)) return
    element%can_be_cut = spec%kind == project_nothing
    element%is_by_rows = .false.
    call separate_rows(element%patch)
    call new_projection(element%projection, spec, grid%axes, element%patch%axes, error)
    if (allocated(error) .or. .not. element%projection%is_smooth) return
    element%is_coupled = .true.
    element%has_own_points = .false.
    element%is_divisible = .false.
    allocate (element%smooth, &
              source=new_smooth_fields(element%projection%smooth, element%patch%axes, &
                                       element%patch%lanes, element%patch%has_gradients))
  end subroutine new_projected_element

  subroutine forces(self, law, dt, report)
    class(projected_element_t), intent(inout) :: self
    class(block_law_t), intent(in) :: law
    real(wp), intent(in) :: dt
    type(force_report_t), intent(out) :: report

    self%patch%n_before = self%n_before
    associate (motion => self%motion)
      if (allocated(self%smooth)) then
        call forces_of_smooth_projection(self%patch, self%projection, self%smooth, self%buffers, &
                                         law, dt, motion%x, motion%v, motion%internal_force, report)
      else if (has_context_kernel(self, law)) then
        call internal_forces(self%patch, self%buffers, law, dt, motion%x, motion%v, &
                             motion%internal_force, report)
      else
        call forces_of_projection(self%patch, self%projection, self%buffers, law, dt, motion%x, &
                                  motion%v, motion%internal_force, report)
      end if
    end associate
  end subroutine forces

  !> Does a kernel of its own serve the law: one with context, for the points of one block, which
  !! rotates no stress itself, without a projection and an outline?
  pure logical function has_context_kernel(self, law)
    class(projected_element_t), intent(in) :: self
    class(block_law_t), intent(in) :: law

    has_context_kernel = self%patch%has_context .and. self%projection%kind == project_nothing &
                  .and. law%n_together == 1 .and. .not. law%is_rotating &
                  .and. .not. self%patch%lanes%is_trimmed
  end function has_context_kernel

  subroutine new_trial(self, block, dt, x, trial)
    class(projected_element_t), intent(in) :: self
    type(block_t), intent(in) :: block
    real(wp), intent(in) :: dt
    real(wp), intent(in), contiguous :: x(:, :, :, :)
    class(block_trial_t), allocatable, intent(out) :: trial

    allocate (projected_trial_t :: trial)
    call begin_trial(self%patch, block, dt, x, self%motion%v, 6, trial)
  end subroutine new_trial

  subroutine try_block(self, law, block, dt, u, trial, f)
    class(projected_element_t), intent(inout) :: self
    class(block_law_t), intent(in) :: law
    type(block_t), intent(in) :: block
    real(wp), intent(in) :: dt
    real(wp), intent(inout) :: u(:, :)
    class(block_trial_t), intent(inout) :: trial
    real(wp), intent(out) :: f(:, :)

    select type (trial)
    type is (projected_trial_t)
      call run_projected(self%patch, self%projection, law, block, dt, u, trial, f)
    end select
  end subroutine try_block

  !> With plain strains where the projection couples elements.
  subroutine single(self, element, copy)
    class(projected_element_t), intent(in) :: self
    integer, intent(in) :: element(3)
    class(element_t), allocatable, intent(out) :: copy
    type(projected_element_t), allocatable :: one

    if (self%projection%is_smooth) then
      call self%solid_element_t%single(element, copy)
      return
    end if
    allocate (one)
    call cut_out(self, element, one)
    call separate_rows(one%patch)
    one%projection = self%projection
    call move_alloc(one, copy)
  end subroutine single

  subroutine describe(self, lines)
    class(projected_element_t), intent(in) :: self
    type(string_t), allocatable, intent(inout) :: lines(:)
    character(:), allocatable :: words

    call self%solid_element_t%describe(lines)
    if (self%projection%kind == project_nothing) return
    associate (projection => self%projection)
      words = ", smooth"
      if (.not. projection%is_smooth) &
        words = " with "//to_text(projection%n_samples(1))//" x "// &
                to_text(projection%n_samples(2))//" x "// &
                to_text(projection%n_samples(3))//" samples"
      call append_text(lines, "projection       "//projection_name(projection%kind)//words)
    end associate
  end subroutine describe

end module projected_element
