!> Is the run still sound? Checked after every force evaluation from what it reports anyway.
module health
  use kinds, only: wp
  use errors, only: error_t, fail
  use text, only: to_text, rounded_text
  use basis_tables, only: n_lanes
  use ig_patch, only: element_of_lane
  use blank, only: blank_t
  use effect, only: effect_slot_t, instant_t
  use contact_effect, only: contact_effect_t
  use step_control, only: step_control_t
  implicit none
  private

  public :: check_health, check_depths

  real(wp), parameter :: collapse = 1.0e-3_wp   ! of the step at the start

contains

  !> Turned elements, laws that failed, values that are no numbers, a collapsed step.
  subroutine check_health(blank, instant, control, error)
    type(blank_t), intent(in) :: blank
    type(instant_t), intent(in) :: instant
    type(step_control_t), intent(in) :: control
    type(error_t), allocatable, intent(out) :: error

    if (blank%report%failed_block < huge(1)) then
      call fail(error, failed_message(blank, instant))
    else if (blank%report%largest_rate*collapse**2 > control%rate_at_start) then
      call fail(error, "blank '"//blank%name//"': the stable step fell below a thousandth of "// &
                "that at the start, "//when(instant)//"; an element is crushed")
    end if
  end subroutine check_health

  !> Depths of all contact pairs against the limits, parts of the thickness. A pair warns once.
  subroutine check_depths(effects, warning_limit, limit, instant, warning, error)
    type(effect_slot_t), intent(inout) :: effects(:)
    real(wp), intent(in) :: warning_limit, limit           !! 0: none
    type(instant_t), intent(in) :: instant
    character(:), allocatable, intent(out) :: warning      !! empty: none
    type(error_t), allocatable, intent(out) :: error
    integer :: i

    warning = ""
    do i = 1, size(effects)
      select type (pair => effects(i)%item)
      type is (contact_effect_t)
        if (limit > 0.0_wp .and. pair%depth > limit*pair%thickness) then
          call fail(error, depth_message(pair, instant)//", limit "//to_text(limit))
          return
        else if (warning_limit > 0.0_wp .and. pair%depth > warning_limit*pair%thickness &
                 .and. .not. pair%has_warned) then
          pair%has_warned = .true.
          if (warning /= "") warning = warning//new_line("a")
          warning = warning//"warning: "//depth_message(pair, instant)
        end if
      end select
    end do
  end subroutine check_depths

  function depth_message(pair, instant) result(message)
    type(contact_effect_t), intent(in) :: pair
    type(instant_t), intent(in) :: instant
    character(:), allocatable :: message

    message = pair%name//": the blank is "//rounded_text(pair%depth/pair%thickness)// &
              " of its thickness deep in the tool, "//when(instant)
  end function depth_message

  !> What failed, where and when. The block's first lane stands for all eight.
  function failed_message(blank, instant) result(message)
    type(blank_t), intent(in) :: blank
    type(instant_t), intent(in) :: instant
    character(:), allocatable :: message, place
    integer :: first(3), last(3)

    associate (body => blank%parts(blank%report%failed_patch))
      first = element_of_lane(body%patch, blank%report%failed_block, 1)
      last = element_of_lane(body%patch, blank%report%failed_block, n_lanes)
      place = ""
      if (size(blank%parts) > 1) place = "patch '"//body%name//"', "
    end associate
    if (blank%report%smallest_det <= 0.0_wp) then
      message = "an element turned inside out"
    else
      message = "the stress update failed or met values that are no numbers"
    end if
    message = "blank '"//blank%name//"': "//message//", "//when(instant)//", in "//place// &
              "elements ("//to_text(first(1))//" to "//to_text(last(1))//", "// &
              to_text(first(2))//", "// &
              to_text(first(3))//") along xi, eta, zeta"
  end function failed_message

  function when(instant) result(text)
    type(instant_t), intent(in) :: instant
    character(:), allocatable :: text

    text = "at time "//to_text(instant%time)
  end function when

end module health
