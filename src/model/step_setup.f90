!> Mass scaling and the stable step that goes with it; damping and relaxation.
module step_setup
  use kinds, only: wp
  use column_scaling, only: difference_masses
  use stable_step, only: largest_frequency, viscous_step
  use element_step, only: stable_element_step
  use blank, only: blank_t
  use boundary, only: boundary_t
  use damping, only: damping_t
  use relaxation, only: relaxation_t
  use thickness_scaling, only: thickness_scaling_t
  use effect, only: effect_slot_t
  use model, only: model_t
  implicit none
  private

  public :: set_stable_step, add_thickness_scaling, add_damping

contains

  !> Scale the masses as the deck asks and find the stable step of what comes out. The supports
  !! must be there already.
  subroutine set_stable_step(model)
    type(model_t), intent(inout) :: model
    real(wp) :: omega

    associate (blank => model%bodies%blank, step => model%step)
      if (step%thickness_factor > 1.0_wp) call scale_columns(model)
      if (step%is_element_step) then
        call stable_element_step(blank%patch, blank%law, blank%solid, model%stable_step, model%rate)
      else
        call largest_frequency(blank%patch, blank%law, blank%motion%x, blank%mass, omega, &
                               model%rate, blank%column_factor)
        model%stable_step = viscous_step(blank%patch, blank%law, blank%motion%x, blank%mass, &
                                         omega, blank%column_factor)
      end if
      if (step%target_step > step%safety*model%stable_step) then
        call scale_uniformly(blank, (step%target_step/(step%safety*model%stable_step))**2)
        model%stable_step = step%target_step/step%safety
      end if
    end associate
  end subroutine set_stable_step

  !> Raise all masses by one factor. The viscosity is that of the heavier material, so that the
  !! damping ratios stay and the stable step grows with the root of the factor.
  subroutine scale_uniformly(blank, factor)
    type(blank_t), intent(inout) :: blank
    real(wp), intent(in) :: factor

    blank%added_mass = factor*(blank%added_mass + sum(blank%mass)) - sum(blank%mass)
    blank%mass = blank%mass*factor
    blank%mass_factor = factor
    blank%patch%viscosity%density = blank%patch%viscosity%density*factor
    blank%patch%viscosity%wave_speed = blank%patch%viscosity%wave_speed/sqrt(factor)
  end subroutine scale_uniformly

  !> Factors of the columns. Where a support holds some points of a column and not the others, its
  !! motion has no mean to keep, and the column stays as it is.
  subroutine scale_columns(model)
    type(model_t), intent(inout) :: model
    real(wp), allocatable :: is_free(:, :, :, :)
    integer :: c

    is_free = free_components(model)
    associate (blank => model%bodies%blank)
      allocate (blank%column_factor(size(blank%mass, 1), size(blank%mass, 2)), &
                source=model%step%thickness_factor)
      do c = 1, 3
        where (maxval(is_free(:, :, :, c), 3) > minval(is_free(:, :, :, c), 3)) &
          blank%column_factor = 1.0_wp
      end do
      blank%added_mass = sum((blank%column_factor - 1.0_wp)*difference_masses(blank%mass))/3.0_wp
    end associate
  end subroutine scale_columns

  !> 1 for components of control points that no support holds, 0 for the others.
  function free_components(model) result(is_free)
    type(model_t), intent(in) :: model
    real(wp), allocatable :: is_free(:, :, :, :)
    integer :: i, p

    allocate (is_free, mold=model%bodies%blank%motion%x)
    is_free = 1.0_wp
    do i = 1, size(model%supports)
      select type (support => model%supports(i)%item)
      type is (boundary_t)
        do p = 1, size(support%points, 2)
          is_free(support%points(1, p), support%points(2, p), support%points(3, p), &
                  support%component) = 0.0_wp
        end do
      end select
    end do
  end function free_components

  !> Put the scaling of columns behind all forces.
  subroutine add_thickness_scaling(model)
    type(model_t), intent(inout) :: model
    type(effect_slot_t) :: slot
    type(thickness_scaling_t) :: scaling

    if (.not. allocated(model%bodies%blank%column_factor)) return
    scaling%name = "thickness scaling"
    allocate (slot%item, source=scaling)
    model%forces = [model%forces, slot]
  end subroutine add_thickness_scaling

  !> Put damping and relaxation before the supports.
  subroutine add_damping(settled_from, model)
    real(wp), intent(in) :: settled_from     !! time from which all curves are constant
    type(model_t), intent(inout) :: model
    type(damping_t) :: damping
    type(relaxation_t) :: relaxation
    type(effect_slot_t) :: slot

    if (model%step%has_relaxation) then
      relaxation%name = "dynamic relaxation"
      relaxation%is_kinetic = model%step%is_kinetic
      relaxation%energy_limit = model%step%energy_residual
      relaxation%force_limit = model%step%force_residual
      relaxation%settled_from = settled_from
      relaxation%is_free = free_components(model)
      allocate (slot%item, source=relaxation)
      model%supports = [slot, model%supports]
    else if (model%step%alpha > 0.0_wp) then
      damping%name = "damping"
      damping%alpha = model%step%alpha
      allocate (slot%item, source=damping)
      model%supports = [slot, model%supports]
    end if
  end subroutine add_damping

end module step_setup
