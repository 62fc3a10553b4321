!> Force-driven tools of the scene as effects of the model.
module drive_setup
  use kinds, only: wp
  use text, only: rounded_text
  use input_errors, only: error_list_t, add_error, add_warning
  use scene, only: scene_t
  use start_gaps, only: sheet_side
  use contact_effect, only: contact_view_t, contact_pairs, net_of_pair
  use tool_drive, only: tool_drive_t
  use boundary_setup, only: curve_of
  use model, only: model_t, increment_limit, add_support
  implicit none
  private

  public :: add_drives

  real(wp), parameter :: mass_factor = 2.0_wp   !! see `add_drive`

contains

  !> One drive for each *TOOL FORCE. Contacts of all steps must be in the force stage.
  subroutine add_drives(scene, model, errors)
    type(scene_t), intent(in) :: scene
    type(model_t), intent(inout) :: model
    type(error_list_t), intent(inout) :: errors
    integer :: i

    do i = 1, size(scene%motions)
      if (.not. scene%motions(i)%is_force) cycle
      call check_direction(scene, i, model, errors)
      call add_drive(scene, i, model, errors)
    end do
  end subroutine add_drives

  !> Warn of a tool whose first move is a force that never presses it on the sheet.
  subroutine check_direction(scene, i, model, errors)
    type(scene_t), intent(in) :: scene
    integer, intent(in) :: i             !! the motion
    type(model_t), intent(in), target :: model
    type(error_list_t), intent(inout) :: errors
    real(wp), parameter :: clearly = 0.1_wp   ! cosine, below which a force goes along the sheet
    real(wp) :: way(3), towards
    real(wp), allocatable :: factors(:), net(:, :, :)
    type(contact_view_t), allocatable :: pairs(:)
    integer :: k

    associate (spec => scene%motions(i))
      if (any(scene%motions%tool == spec%tool .and. scene%motions%step < spec%step)) return
      factors = [1.0_wp]
      if (spec%curve > 0) factors = scene%curves(spec%curve)%values
      way = 0.0_wp
      pairs = contact_pairs(model%forces)
      do k = 1, size(pairs)
        if (pairs(k)%pair%tool /= spec%tool) cycle
        call net_of_pair(pairs(k)%pair, model%bodies%blank%parts, net)
        way = way + sheet_side(model%bodies%tools(spec%tool), reshape(net, [size(net)/3, 3]))
      end do
      towards = dot_product(spec%vector, way)/(norm2(spec%vector)*max(norm2(way), tiny(1.0_wp)))
      if (.not. any(abs(factors) > 0.0_wp)) return
      if (abs(towards) < clearly) then
        ! A motion may press the tool that a force draws along.
        if (norm2(way) < clearly .or. any(scene%motions%tool == spec%tool .and. &
            scene%motions%step == spec%step .and. .not. scene%motions%is_force)) return
        call add_warning(errors, spec%origin, "a force along the surface of the tool "// &
                         scene%tools(spec%tool)%name//", which does not press it on the blank", &
                         "a force across the blank")
        return
      end if
      if (any(factors*towards > 0.0_wp)) return
      call add_warning(errors, spec%origin, "a force that draws the tool "// &
                       scene%tools(spec%tool)%name//" away from the blank at all times", &
                       "the opposite sign, or the SIDE of the *TOOL on which the blank lies")
    end associate
  end subroutine check_direction

  !> Mass: a tool that rests on penalty springs of stiffness k in all adds k dt^2/m to what blank
  !! and penalty already take of the limit 4 of a stable step. Twice k dt^2 keeps that below 1/2.
  subroutine add_drive(scene, i, model, errors)
    type(scene_t), intent(in) :: scene
    integer, intent(in) :: i                   !! the motion
    type(model_t), intent(inout), target :: model
    type(error_list_t), intent(inout) :: errors
    type(tool_drive_t) :: drive
    type(contact_view_t), allocatable :: pairs(:)
    real(wp) :: stiffness, least
    integer :: j

    associate (spec => scene%motions(i), step => increment_limit(model))
      stiffness = 0.0_wp   ! of all contact springs of the tool, if all were pressed
      pairs = contact_pairs(model%forces)
      do j = 1, size(pairs)
        associate (pair => pairs(j)%pair)
          if (pair%tool == spec%tool) stiffness = stiffness + sum(pair%pair%stiffness)
        end associate
      end do
      least = mass_factor*stiffness*step**2
      drive%name = "force on "//scene%tools(spec%tool)%name
      drive%tool = spec%tool
      drive%direction = spec%vector/norm2(spec%vector)
      drive%value = norm2(spec%vector)
      drive%curve = curve_of(scene, spec%curve)
      drive%mass = spec%mass
      if (.not. spec%mass > 0.0_wp) drive%mass = least
      if (.not. drive%mass > 0.0_wp) then
        call add_error(errors, spec%origin, "a force on tool "//scene%tools(spec%tool)%name// &
                       ", which has no contact to choose its mass by", &
                       "MASS, or a *CONTACT PAIR of the tool")
        return
      end if
      if (drive%mass < 0.5_wp*least) then
        call add_warning(errors, spec%origin, "a mass of "// &
                         rounded_text(model%width_ratio*drive%mass)//", for which the time "// &
                         "step may be too large", &
                         "at least "//rounded_text(model%width_ratio*least))
      else if (.not. spec%mass > 0.0_wp) then
        drive%name = drive%name//", mass "//rounded_text(model%width_ratio*drive%mass)//" chosen"
      end if
      drive%alpha = 2.0_wp*spec%damping*sqrt(stiffness/drive%mass)
      drive%first_step = spec%step
      drive%given_step = spec%step
      drive%last_step = minval([huge(1), (scene%motions(j)%step - 1, j=1, size(scene%motions))], &
                               mask=[.true., (scene%motions(j)%tool == spec%tool .and. &
                                     scene%motions(j)%step > spec%step, j=1, size(scene%motions))])
    end associate
    call add_support(model, drive)
  end subroutine add_drive

end module drive_setup
