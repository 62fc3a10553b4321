!> All checks of a set-up that need the model: what would run, but not as it is meant.
module setup_check
  use kinds, only: wp
  use text, only: string_t
  use input_errors, only: error_list_t, n_errors
  use scene, only: scene_t
  use model, only: model_t
  use tool_setup, only: sheet_thickness
  use unit_check, only: check_units
  use shape_check, only: check_shape
  use reach_check, only: encounter_t, encounters_of, check_reach
  use clearance_check, only: check_clearance
  use bend_check, only: check_bends, check_layers
  use symmetry_check, only: check_symmetry, check_symmetry_names
  use effort_check, only: check_effort, add_effort_lines
  use amount_check, only: check_amounts
  use stroke_check, only: check_strokes, add_stroke_lines
  use load_check, only: check_loads
  use motion_check, only: check_travels, check_removals
  use outline_check, only: check_trims
  use release_check, only: check_release
  use step_check, only: check_motion, check_friction, check_forces, check_supports
  implicit none
  private

  public :: check_setup

contains

  !> Add warnings, and errors where the run could only be wrong; after errors of contact pairs only
  !! what else is wrong with the tools. `lines` say how the tools travel and
  !! how large the forces of inertia are.
  subroutine check_setup(scene, model, errors, lines)
    type(scene_t), intent(in) :: scene
    type(model_t), intent(in) :: model
    type(error_list_t), intent(inout) :: errors
    type(string_t), allocatable, intent(out) :: lines(:)
    type(encounter_t), allocatable :: encounters(:)
    real(wp) :: thickness
    logical :: is_read, is_squeezed
    integer :: t

    thickness = sheet_thickness(scene%blank)
    call check_units(scene, thickness, errors)
    is_read = n_errors(errors) == 0
    if (is_read) then
      call check_motion(scene, errors)
      call check_friction(scene, errors)
      call check_loads(scene, errors)
      call check_symmetry_names(scene, errors)
      call check_supports(scene, errors)
      call check_release(scene, model, thickness, errors)
      call check_strokes(scene, model, thickness, errors)
      call check_removals(scene, errors)
      call check_trims(scene, model, errors)
    end if
    do t = 1, size(scene%tools)
      call check_shape(model%bodies%tools(t), thickness, scene%tools(t)%origin, errors)
    end do
    encounters = encounters_of(scene, model, thickness)
    call check_symmetry(scene, model, encounters, thickness, errors)
    call check_reach(scene, model, encounters, thickness, errors)
    call check_clearance(scene, model, encounters, thickness, errors, is_squeezed)
    if (is_read) call check_travels(scene, model, thickness, is_squeezed, errors)
    call check_bends(scene, model, encounters, thickness, errors)
    call check_layers(scene, model, encounters, thickness, errors)
    call check_forces(scene, model, encounters, thickness, errors)
    call check_amounts(scene, model, encounters, thickness, errors)
    call check_effort(scene, model, encounters, thickness, errors)
    allocate (lines(0))
    call add_stroke_lines(scene, model, lines)
    call add_effort_lines(scene, model, encounters, thickness, lines)
  end subroutine check_setup

end module setup_check
