!> Solids that shells would serve: what the run would then take.
module shell_offer
  use kinds, only: wp
  use text, only: string_t, to_text, rounded_text, append_text
  use input_errors, only: error_list_t, n_errors
  use scene, only: scene_t
  use model, only: model_t
  use tool_setup, only: sheet_thickness
  use model_setup, only: build_model
  use blank_keywords, only: set_layers
  use shell_check, only: check_shell
  use reach_check, only: encounter_t, encounters_of
  use clearance_check, only: check_clearance
  use bend_check, only: check_bends
  use run_forecast, only: forecast_t, outlook_t, new_forecast
  use check_report, only: n_steps_of
  implicit none
  private

  public :: could_be_shells, shell_lines

contains

  !> Is the blank a thin sheet between tools, and speaks nothing against shells?
  logical function could_be_shells(scene, model)
    type(scene_t), intent(in) :: scene
    type(model_t), intent(in) :: model          !! before its first step
    real(wp), parameter :: thin = 0.05_wp       ! of the length
    type(encounter_t), allocatable :: encounters(:)
    type(error_list_t) :: objections
    type(scene_t) :: shells
    real(wp) :: thickness, low(3), high(3)
    integer :: p, c

    could_be_shells = .false.
    if (scene%blank%is_shell .or. size(scene%contacts) == 0) return
    thickness = sheet_thickness(scene%blank)
    low = huge(1.0_wp)
    high = -huge(1.0_wp)
    do p = 1, size(scene%blank%patches)
      associate (patch => scene%blank%patches(p))
        low = min(low, [(minval(patch%solid%points(:, :, :, c)), c=1, 3)])
        high = max(high, [(maxval(patch%solid%points(:, :, :, c)), c=1, 3)])
      end associate
    end do
    if (thickness > thin*maxval(high - low)) return
    shells = as_shells(scene)
    encounters = encounters_of(shells, model, thickness)
    call check_shell(shells, objections)
    call check_bends(shells, model, encounters, thickness, objections)
    call check_clearance(shells, model, encounters, thickness, objections)
    could_be_shells = objections%n_items == 0
  end function could_be_shells

  !> The same with shells of the recommended rule.
  function as_shells(scene) result(shells)
    type(scene_t), intent(in) :: scene
    type(scene_t) :: shells
    integer :: p

    shells = scene
    shells%blank%is_shell = .true.
    shells%blank%projection = "NONE"
    shells%blank%is_smooth = .false.
    shells%blank%n_samples = 0
    shells%step%thickness_factor = 1.0_wp
    if (allocated(shells%later_steps)) shells%later_steps%step%thickness_factor = 1.0_wp
    do p = 1, size(shells%blank%patches)
      associate (patch => shells%blank%patches(p))
        patch%n_points = patch%solid%axes%degree
        patch%n_parts = 1
        call set_layers(patch)
      end associate
    end do
  end function as_shells

  !> A line with what the run takes as shells, measured as that of the solids, where that is less.
  function shell_lines(scene, set_up, seconds) result(lines)
    type(scene_t), intent(in) :: scene          !! with solids
    real(wp), intent(in) :: set_up              !! before the first step [s]
    real(wp), intent(in) :: seconds             !! of the run with them [s]
    type(string_t), allocatable :: lines(:)
    real(wp), parameter :: worth = 0.9_wp
    type(scene_t) :: shells
    type(model_t) :: model
    type(error_list_t) :: errors
    type(outlook_t) :: outlook
    type(forecast_t) :: forecast

    allocate (lines(0))
    shells = as_shells(scene)
    call build_model(shells, model, errors)
    if (n_errors(errors) > 0) return
    outlook%set_up = set_up
    forecast = new_forecast(model, n_steps_of(model), outlook)
    if (.not. forecast%seconds < worth*seconds) return
    call append_text(lines, "could be         shells (ELEMENT=SHELL): about "// &
                     rounded_text(forecast%seconds)//" s of processor time, saves "// &
                     to_text(nint(100.0_wp*(1.0_wp - forecast%seconds/seconds)))//" %")
  end function shell_lines

end module shell_offer
