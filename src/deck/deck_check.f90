!> Checks that need more than one keyword: what is missing, what is in the wrong step, what is
!! empty, what never happens.
module deck_check
  use kinds, only: wp
  use text, only: to_text, rounded_text
  use input_errors, only: error_list_t, add_error, add_warning
  use nurbs_solid, only: nurbs_solid_t
  use scene, only: scene_t, step_spec_t, is_held
  use keyword_spec, only: keyword_spec_t, in_first_step, inside_step, needs_step, anywhere, &
                          may_be_in_step
  use deck_records, only: record_t, parsed_deck_t, find_records, deck_end
  implicit none
  private

  public :: check_presence, check_steps, check_scene

  !> Box that holds control points, along x, y and z.
  type :: bounds_t
    real(wp) :: lower(3) = huge(1.0_wp), upper(3) = -huge(1.0_wp)
  end type bounds_t

contains

  !> Errors for keywords that every deck must have.
  subroutine check_presence(deck, errors)
    type(parsed_deck_t), intent(in) :: deck
    type(error_list_t), intent(inout) :: errors
    character(:), allocatable :: hint
    integer :: i

    hint = ""
    if (size(find_records(deck, "MATERIAL TEST")) > 0) then
      hint = "; `igaform material DECK` carries out its *MATERIAL TEST"
    end if

    do i = 1, size(deck%keywords)
      if (.not. deck%keywords(i)%is_required) cycle
      if (size(find_records(deck, deck%keywords(i)%name)) == 0) then
        call add_error(errors, deck_end(deck%lexed), "no *"//deck%keywords(i)%name// &
                       " in the deck, which ends here", "one *"//deck%keywords(i)%name//hint)
      end if
    end do
    if (size(kinds_of_step(deck)) == 0) &
      call add_error(errors, deck_end(deck%lexed), "no *DYNAMIC, *STATIC or *FREQUENCY in the "// &
                     "deck, which ends here", "one of them"//hint)
  end subroutine check_presence

  !> The records that say what kind of step it is.
  function kinds_of_step(deck) result(records)
    type(parsed_deck_t), intent(in) :: deck
    integer, allocatable :: records(:)

    records = [find_records(deck, "DYNAMIC"), find_records(deck, "STATIC"), &
               find_records(deck, "FREQUENCY")]
  end function kinds_of_step

  !> Errors for keywords in the wrong place, and for steps without end or kind.
  subroutine check_steps(deck, errors)
    type(parsed_deck_t), intent(in) :: deck
    type(error_list_t), intent(inout) :: errors
    character(:), allocatable :: name
    integer, allocatable :: starts(:), kinds(:)
    logical :: is_open
    integer :: i, n

    starts = find_records(deck, "STEP")
    kinds = kinds_of_step(deck)
    is_open = .false.
    do i = 1, size(deck%records)
      associate (record => deck%records(i))
        if (record%spec == 0) cycle
        name = deck%keywords(record%spec)%name
        if (name == "STEP") then
          if (is_open) call add_error(errors, record%origin, "the step of line "//to_text( &
            deck%records(starts(record%step - 1))%origin%line)//" still open", &
            "an *END STEP before it")
          is_open = .true.
        else if (name == "END STEP") then
          if (.not. is_open) call add_error(errors, record%origin, "no step to end", &
                                            "a *STEP before it")
          is_open = .false.
        else if (size(starts) == 0) then
          if (deck%keywords(record%spec)%place == needs_step) call add_error(errors, &
            record%origin, "no step that it belongs to", "it in a *STEP")
        else
          call check_place(deck%keywords(record%spec), record, is_open, errors)
        end if
      end associate
    end do
    if (is_open) call add_error(errors, deck%records(starts(size(starts)))%origin, &
                                "a step that does not end", "an *END STEP at its end")
    if (size(starts) == 0) then
      if (count([size(find_records(deck, "DYNAMIC")), size(find_records(deck, "STATIC")), &
                 size(find_records(deck, "FREQUENCY"))] > 0) > 1) &
        call add_error(errors, deck%records(kinds(size(kinds)))%origin, "more than one of "// &
                       "*DYNAMIC, *STATIC and *FREQUENCY in a deck without steps", &
                       "one of them, or each in a *STEP")
    end if
    do i = 1, size(starts)
      n = count(deck%records(kinds)%step == i)
      if (n == 0) call add_error(errors, deck%records(starts(i))%origin, "no *DYNAMIC, *STATIC "// &
                                 "or *FREQUENCY in step "//to_text(i), "one of them in every step")
      if (n > 1) call add_error(errors, deck%records(starts(i))%origin, "more than one of "// &
                                "*DYNAMIC, *STATIC and *FREQUENCY in step "//to_text(i), &
                                "one of them in every step")
    end do
  end subroutine check_steps

  !> One keyword of a deck with steps.
  subroutine check_place(keyword, record, is_open, errors)
    type(keyword_spec_t), intent(in) :: keyword
    type(record_t), intent(in) :: record
    logical, intent(in) :: is_open       !! the record is in a step
    type(error_list_t), intent(inout) :: errors

    if (record%step == 0) then
      if (keyword%place == inside_step .or. keyword%place == needs_step) &
        call add_error(errors, record%origin, "it before the first *STEP", "it in a step")
    else if (keyword%place == anywhere) then
      return
    else if (.not. is_open) then
      call add_error(errors, record%origin, "it after *END STEP", &
                     trim(merge("it in a step, or before the first", &
                                "it before the first *STEP        ", may_be_in_step(keyword))))
    else if (keyword%place == in_first_step) then
      if (record%step > 1) call add_error(errors, record%origin, "it in a later step", &
        "it before the first *STEP or in the first step; it applies in all")
    else if (.not. may_be_in_step(keyword)) then
      call add_error(errors, record%origin, "it in a step", "it before the first *STEP")
    end if
  end subroutine check_place

  !> Checks of a scene without errors so far.
  subroutine check_scene(scene, errors)
    type(scene_t), intent(in) :: scene
    type(error_list_t), intent(inout) :: errors
    integer :: i

    call check_sets(scene, errors)
    call check_static_steps(scene, errors)
    call check_thickness(scene, errors)
    call check_thickness_degree(scene, errors)
    do i = 1, size(scene%tools)
      call check_tool(scene, i, errors)
    end do
  end subroutine check_scene

  !> What may not act in a static step.
  subroutine check_static_steps(scene, errors)
    type(scene_t), intent(in) :: scene
    type(error_list_t), intent(inout) :: errors
    type(step_spec_t) :: step
    integer :: i

    do i = 1, size(scene%later_steps) + 1
      step = scene%step
      if (i > 1) step = scene%later_steps(i - 1)%step
      if (.not. step%is_static) cycle
      if (step%has_relaxation) call add_error(errors, step%origin, "*DYNAMIC RELAXATION in the "// &
        "static step "//to_text(i), "one or the other")
    end do
  end subroutine check_static_steps

  !> A set must hold control points: their Greville abscissae decide.
  subroutine check_sets(scene, errors)
    type(scene_t), intent(in) :: scene
    type(error_list_t), intent(inout) :: errors
    integer :: i, p

    do i = 1, size(scene%sets)
      if (any([(any(is_held(scene%blank%patches(p)%solid, scene%sets(i), p)), &
                p=1, size(scene%blank%patches))])) cycle
      call add_error(errors, scene%sets(i)%origin, "the set "//scene%sets(i)%name// &
                     ", which contains no control point", "bounds that contain Greville abscissae")
    end do
  end subroutine check_sets

  !> The third axis must be the thickness, on which contact, thickness and rules rely. A strip of
  !! `*REDUCE`, or one that is held all over along its width, may be narrower than it is thick.
  subroutine check_thickness(scene, errors)
    type(scene_t), intent(in) :: scene
    type(error_list_t), intent(inout) :: errors
    real(wp), parameter :: clearly = 0.5_wp
    real(wp) :: extent(3)
    integer :: p, i, thin

    do p = 1, size(scene%blank%patches)
      extent = extents(scene%blank%patches(p)%solid)
      thin = minloc(extent(:2), 1)
      if (extent(thin) >= clearly*extent(3)) then
        if (extent(3) <= maxval(extent(:2))) cycle
      else if (thin == scene%reduction%axis .or. any([(is_held_everywhere(scene, &
               scene%boundaries(i)%set), i=1, size(scene%boundaries))])) then
        cycle
      end if
      call add_warning(errors, scene%blank%origin, "axis 3 of the blank, "// &
                       rounded_text(extent(3))//" long, as its thickness, though axis "// &
                       to_text(minloc(extent, 1))//" is the thinnest, "// &
                       rounded_text(minval(extent)), "the thickness as axis 3 (zeta), on which "// &
                       "contact, thickness and rules rely, the longest side as axis 1")
      return
    end do
  end subroutine check_thickness

  !> Warn of a sheet of degree 1 through its thickness: in bending, the strain that Poisson's ratio
  !! asks for through the thickness is linear, and degree 1 has none. Without a ratio nothing is
  !! asked for, and a blank that is held all over does not bend through its thickness.
  subroutine check_thickness_degree(scene, errors)
    type(scene_t), intent(in) :: scene
    type(error_list_t), intent(inout) :: errors
    real(wp), parameter :: thin = 0.2_wp   ! of the longest side: what is thicker hardly bends
    real(wp) :: extent(3)
    integer :: p

    if (scene%blank%projection == "ANS" .or. scene%blank%is_shell) return
    if (.not. abs(scene%materials(scene%blank%material)%poisson) > 0.0_wp) return
    if (any([(is_held_everywhere(scene, scene%boundaries(p)%set), &
              p=1, size(scene%boundaries))])) return
    do p = 1, size(scene%blank%patches)
      associate (solid => scene%blank%patches(p)%solid)
        extent = extents(solid)
        if (solid%axes(3)%degree > 1 .or. extent(3) > thin*maxval(extent)) cycle
      end associate
      call add_warning(errors, scene%blank%origin, "degree 1 through the thickness of a sheet, "// &
                       "which is far too stiff in bending", "PROJECTION=ANS, or degree 2")
      return
    end do
  end subroutine check_thickness_degree

  !> Does a set hold all control points?
  pure logical function is_held_everywhere(scene, set) result(is_all)
    type(scene_t), intent(in) :: scene
    integer, intent(in) :: set
    integer :: p

    is_all = all([(all(is_held(scene%blank%patches(p)%solid, scene%sets(set), p)), &
                   p=1, size(scene%blank%patches))])
  end function is_held_everywhere

  !> Greatest lengths of the control polygons along the three axes: a closed curve has a length,
  !! though its ends meet.
  pure function extents(solid) result(extent)
    type(nurbs_solid_t), intent(in) :: solid
    real(wp) :: extent(3)
    integer :: n(3)

    n = ubound(solid%points(:, :, :, 1))
    associate (p => solid%points)
      extent(1) = maxval(sum(norm2(p(2:, :, :, :) - p(:n(1) - 1, :, :, :), 4), 1))
      extent(2) = maxval(sum(norm2(p(:, 2:, :, :) - p(:, :n(2) - 1, :, :), 4), 2))
      extent(3) = maxval(sum(norm2(p(:, :, 2:, :) - p(:, :, :n(3) - 1, :), 4), 3))
    end associate
  end function extents

  !> Warn of a tool that no contact pair, no bead and no offset names.
  subroutine check_tool(scene, i, errors)
    type(scene_t), intent(in) :: scene
    integer, intent(in) :: i
    type(error_list_t), intent(inout) :: errors

    if (any(scene%contacts%tool == i)) return
    if (any(scene%beads%closing == i)) return   ! whose way the forces of a bead run over
    if (any(scene%tools%offset_of == i)) return   ! from which another tool is made
    call add_warning(errors, scene%tools(i)%origin, "the tool "//scene%tools(i)%name// &
                     ", which touches nothing", "a *CONTACT PAIR that names it")
  end subroutine check_tool

end module deck_check
