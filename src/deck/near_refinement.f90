!> *REFINE with NEAR: knots of a box blank so that its elements are of a given size near a tool and
!! grow away from it.
module near_refinement
  use kinds, only: wp
  use failure, only: error_t
  use input_errors, only: error_list_t, add_error, add_warning
  use text, only: rounded_text
  use knot_vector, only: breaks
  use nurbs_solid, only: nurbs_solid_t, evaluate_solid
  use refinement, only: insert_knots
  use scene, only: scene_t, tool_spec_t
  use deck_records, only: parsed_deck_t, record_t, deck_context_t, find_records, option_text, &
                          option_real, option_integer, is_option_given, resolve_option
  use patch_keywords, only: is_too_fine
  implicit none
  private

  public :: refine_near_tools

  integer, parameter :: n_samples = 400           !! of an element

  !> Elements of `size` within a zone of a coordinate, of `size` + (ratio - 1) distance beyond it,
  !! so that neighbours differ by the ratio.
  type :: sizing_t
    integer :: component = 1                      !! the coordinate
    real(wp) :: zone(2) = 0.0_wp                  !! from, to [length]
    real(wp) :: size = 0.0_wp, ratio = 1.0_wp     !! [length]; at least 1
  end type sizing_t

contains

  !> Refine the blank by all *REFINE with NEAR, in the order of the deck; tools have been read.
  subroutine refine_near_tools(deck, context, scene, errors)
    type(parsed_deck_t), intent(in) :: deck
    type(deck_context_t), intent(inout) :: context
    type(scene_t), intent(inout) :: scene
    type(error_list_t), intent(inout) :: errors
    integer, allocatable :: found(:)
    integer :: i, tool, axis

    found = find_records(deck, "REFINE")
    do i = 1, size(found)
      associate (record => deck%records(found(i)))
        if (.not. record%is_valid) cycle
        call check_options(record, errors)
        if (.not. is_option_given(record, "NEAR")) cycle
        call resolve_option(record, "NEAR", context%names%tools, "*TOOL", tool, errors)
        if (.not. (context%frame%is_box .and. any(context%parts(1)%refinements == found(i)))) then
          call add_error(errors, record%origin, "NEAR for a patch that is no blank of TYPE=BOX", &
                         "PATCH=name of such a blank")
          cycle
        end if
        if (tool == 0 .or. .not. option_real(record, "SIZE") > 0.0_wp) cycle
        if (size(scene%tools(tool)%surfaces) == 0) cycle              ! it has errors of its own
        if (.not. allocated(scene%blank%patches(1)%solid%points)) cycle
        do axis = 1, 2
          if (is_option_given(record, "AXIS") .and. option_integer(record, "AXIS") /= axis) cycle
          call refine_axis(record, axis, context%frame%axis_of(axis), scene%tools(tool), &
                           scene%blank%patches(1)%solid, errors)
        end do
      end associate
    end do
  end subroutine refine_near_tools

  !> Options that go together.
  subroutine check_options(record, errors)
    type(record_t), intent(in) :: record
    type(error_list_t), intent(inout) :: errors
    character(*), parameter :: of_near(2) = [character(6) :: "SIZE", "MARGIN"]
    integer :: i

    if (is_option_given(record, "NEAR")) then
      if (.not. is_option_given(record, "SIZE")) call add_error(errors, record%origin, &
        "no option SIZE", "SIZE=length of the elements near the tool")
      if (option_integer(record, "AXIS") == 3) call add_error(errors, record%origin, &
        "AXIS=3 with NEAR", "AXIS=1, 2 or none: both")
      if (is_option_given(record, "AXIS")) return
      if (option_integer(record, "ELEVATE") > 0 .or. option_integer(record, "SUBDIVIDE") > 1 .or. &
          record%n_lines > 0) call add_error(errors, record%origin, &
        "ELEVATE, SUBDIVIDE or knots with NEAR for both axes", &
        "AXIS=1 or 2, or a *REFINE of its own")
      return
    end if
    if (.not. is_option_given(record, "AXIS")) call add_error(errors, record%origin, &
      "no option AXIS", "AXIS=1, 2 or 3")
    do i = 1, size(of_near)
      if (is_option_given(record, trim(of_near(i)))) call add_error(errors, record%origin, &
        "the option "//trim(of_near(i))//" without NEAR", "NEAR=name of a tool")
    end do
  end subroutine check_options

  !> Refine one axis of the blank.
  subroutine refine_axis(record, axis, component, tool, solid, errors)
    type(record_t), intent(in) :: record
    integer, intent(in) :: axis, component        !! of the blank, and the coordinate it runs along
    type(tool_spec_t), intent(in) :: tool
    type(nurbs_solid_t), intent(inout) :: solid
    type(error_list_t), intent(inout) :: errors
    type(error_t), allocatable :: error
    type(sizing_t) :: sizing
    real(wp), allocatable :: knots(:), lines(:)
    integer, allocatable :: n(:)
    real(wp) :: zone(2), blank(2)
    integer :: s, i

    zone = [minval([(minval(tool%surfaces(s)%points(:, :, component)), s=1, &
                     size(tool%surfaces))]) - option_real(record, "MARGIN"), &
            maxval([(maxval(tool%surfaces(s)%points(:, :, component)), s=1, &
                     size(tool%surfaces))]) + option_real(record, "MARGIN")]
    blank = [minval(solid%points(:, :, :, component)), maxval(solid%points(:, :, :, component))]
    if (zone(1) > blank(2) .or. zone(2) < blank(1)) call add_warning(errors, record%origin, &
      "the tool "//tool%name//", whose box with the MARGIN goes from "//rounded_text(zone(1))// &
      " to "//rounded_text(zone(2))//", next to the blank from "//rounded_text(blank(1))//" to "// &
      rounded_text(blank(2)), "a tool above the blank, or a larger MARGIN")
    sizing%zone = zone
    sizing%component = component
    sizing%size = option_real(record, "SIZE")
    sizing%ratio = option_real(record, "RATIO")
    lines = breaks(solid%axes(axis))
    n = [(n_parts(solid, axis, lines(i:i + 1), sizing), i=1, size(lines) - 1)]
    if (is_too_fine(solid%axes, axis, sum(min(n, huge(n)/size(n)) - 1), record, errors)) return
    knots = [(dividing_places(solid, axis, lines(i:i + 1), sizing, n(i)), i=1, size(n))]
    call insert_knots(solid, axis, knots, error)
    if (allocated(error)) call add_error(errors, record%origin, "what cannot be done ("// &
                                         error%message//")", "another SIZE")
  end subroutine refine_axis

  !> Parts of an element that are no longer than they may be, in the mean.
  integer function n_parts(solid, axis, ends, sizing) result(n)
    type(nurbs_solid_t), intent(in) :: solid
    integer, intent(in) :: axis
    real(wp), intent(in) :: ends(2)               !! of the element, knots
    type(sizing_t), intent(in) :: sizing
    real(wp), parameter :: round_off = 1.0e-6_wp, most = 1.0e9_wp
    real(wp) :: total(0:n_samples)

    call count_parts(solid, axis, ends, sizing, total)
    n = max(1, ceiling(min(total(n_samples), most) - round_off))
  end function n_parts

  !> Knots that divide an element into parts, each of the same share of the parts that it may have.
  function dividing_places(solid, axis, ends, sizing, n) result(knots)
    type(nurbs_solid_t), intent(in) :: solid
    integer, intent(in) :: axis, n                !! parts
    real(wp), intent(in) :: ends(2)
    type(sizing_t), intent(in) :: sizing
    real(wp) :: knots(n - 1)
    real(wp) :: total(0:n_samples), share
    integer :: i, k

    call count_parts(solid, axis, ends, sizing, total)
    i = 0
    do k = 1, n - 1
      share = total(n_samples)*k/n
      do while (total(i + 1) < share)
        i = i + 1
      end do
      knots(k) = ends(1) + (ends(2) - ends(1))*(i + (share - total(i))/(total(i + 1) - total(i))) &
                           /n_samples
    end do
  end function dividing_places

  !> Parts from the begin of an element to places in it: the integral of one over their length.
  subroutine count_parts(solid, axis, ends, sizing, total)
    type(nurbs_solid_t), intent(in) :: solid
    integer, intent(in) :: axis
    real(wp), intent(in) :: ends(2)
    type(sizing_t), intent(in) :: sizing
    real(wp), intent(out) :: total(0:n_samples)
    real(wp) :: x(3), at(3), place(0:n_samples), density(0:n_samples)
    integer :: i, k

    do k = 1, 3
      associate (u => solid%axes(k)%knots)
        at(k) = 0.5_wp*(u(1) + u(size(u)))
      end associate
    end do
    do i = 0, n_samples
      at(axis) = ends(1) + (ends(2) - ends(1))*i/n_samples
      call evaluate_solid(solid, at, x)
      place(i) = x(sizing%component)
    end do
    density = 1.0_wp/(sizing%size + (sizing%ratio - 1.0_wp) &
                      *max(sizing%zone(1) - place, place - sizing%zone(2), 0.0_wp))
    total(0) = 0.0_wp
    do i = 1, n_samples
      total(i) = total(i - 1) + 0.5_wp*(density(i - 1) + density(i))*abs(place(i) - place(i - 1))
    end do
  end subroutine count_parts

end module near_refinement
