!> What the trims of later steps cut away completely, as far as the sheet at the start shows.
module outline_check
  use kinds, only: wp
  use text, only: to_text, rounded_text, place_text
  use failure, only: error_t
  use input_errors, only: error_list_t, add_error, add_warning
  use scene, only: scene_t
  use knot_vector, only: breaks
  use nurbs_solid, only: evaluate_solid
  use outline, only: region_t, new_region, inside_distance, cut_to_box, covers_box, plane_of, &
                     in_space
  use element, only: element_t
  use blank, only: blank_t
  use blank_trim, only: trim_t, loss_t, cut_blank, slit_words, slit_remedy, is_edge_on, &
                        edge_on_words
  use outline_units, only: unit_hint
  use outline_watch, only: watched_t, is_gone
  use model, only: model_t
  implicit none
  private

  public :: check_trims

  real(wp), parameter :: unlimited = 1.0e30_wp   !! [length]

contains

  !> Warn of supports, loads and history points that lie outside of a trim by more than the tools
  !! may carry the sheet. What is nearer is reported by the run when it trims.
  subroutine check_trims(scene, model, errors)
    type(scene_t), intent(in) :: scene
    type(model_t), intent(in) :: model
    type(error_list_t), intent(inout) :: errors
    logical :: is_reported(size(model%watched)), is_wrong(size(model%trims))
    real(wp) :: reach
    integer :: t, i

    is_reported = model%watched%is_reported
    is_wrong = .false.
    do t = 1, size(model%trims)
      associate (trim => model%trims(t))
        if (trim%step <= 1 .or. trim%is_flat) cycle
        is_wrong(t) = is_edge_on(model%bodies%blank%parts(1)%element, trim%axis)
        if (is_wrong(t)) call add_warning(errors, trim%origin, edge_on_words(trim%axis)// &
          " at the start", "another DIRECTION, unless the sheet is turned before")
        reach = way_before(scene, trim%step)
        if (reach < unlimited .and. .not. is_wrong(t)) call check_meeting(trim, &
          model%bodies%blank%parts(1)%element, reach, scene%units, is_wrong(t), errors)
        do i = 1, size(is_reported)
          if (is_reported(i) .or. model%watched(i)%last_step < trim%step) cycle
          is_reported(i) = is_beyond(model%watched(i), trim, &
                                     model%bodies%blank%parts(1)%element, reach)
          if (is_reported(i)) call warn_of_cut(model%watched(i), trim, errors)
        end do
      end associate
    end do
    call check_flat_trims(scene, model, is_reported, errors)
    if (.not. any(is_wrong)) call check_rest(scene, model, errors)
  end subroutine check_trims

  !> Warn of the trim that, with those before it, leaves nothing of the sheet, wherever tools and
  !! supports carry it.
  subroutine check_rest(scene, model, errors)
    type(scene_t), intent(in) :: scene
    type(model_t), intent(in) :: model
    type(error_list_t), intent(inout) :: errors
    character(:), allocatable :: expected
    real(wp) :: reach(size(model%trims))
    integer :: t, last

    if (.not. any(model%trims%step > 1 .and. .not. model%trims%is_flat)) return
    reach = 0.0_wp
    do t = 1, size(reach)
      if (.not. model%trims(t)%is_flat) reach(t) = way_before(scene, model%trims(t)%step)
    end do
    call find_last_cut(model%trims, reach, model%bodies%blank%parts(1)%element, last)
    if (last == 0) return
    if (model%trims(last)%is_flat) return
    expected = "curves that keep a part of the formed sheet, which tools and supports move by "// &
               rounded_text(reach(last))//" at most before"
    call add_warning(errors, model%trims(last)%origin, "a trim that leaves nothing of the "// &
                     "sheet as it is at the start, with the trims before it", expected)
  end subroutine check_rest

  !> The trim after which all of the sheet is gone; 0 if some of it may stay. An element is gone
  !! where its centre at the start lies farther outside than its farthest corner lies from it and
  !! the sheet is carried, together.
  subroutine find_last_cut(trims, reach, element, last)
    type(trim_t), intent(in) :: trims(:)
    real(wp), intent(in) :: reach(:)              !! of the sheet before each [length]
    class(element_t), intent(in) :: element
    integer, intent(out) :: last
    type(region_t) :: regions(size(trims))
    real(wp), allocatable :: lines1(:), lines2(:)
    real(wp) :: x(3), corners(3, 0:1, 0:1), radius
    integer :: i, j, k, l, t, plane(2)

    do t = 1, size(trims)
      call new_region(regions(t), trims(t)%polygons, trims(t)%is_outside)
    end do
    lines1 = breaks(element%grid%axes(1))
    lines2 = breaks(element%grid%axes(2))
    last = 0
    do j = 1, size(lines2) - 1
      do i = 1, size(lines1) - 1
        if (element%is_outside([i, j, 1])) cycle
        do l = 0, 1
          do k = 0, 1
            call evaluate_solid(element%grid, [lines1(i + k), lines2(j + l), 0.5_wp], &
                                corners(:, k, l))
          end do
        end do
        call evaluate_solid(element%grid, [0.5_wp*(lines1(i) + lines1(i + 1)), &
                                           0.5_wp*(lines2(j) + lines2(j + 1)), 0.5_wp], x)
        do t = 1, size(trims)
          if (trims(t)%step <= 1) cycle
          plane = plane_of(trims(t)%axis)
          radius = maxval([((norm2(x(plane) - corners(plane, k, l)), k=0, 1), l=0, 1)])
          if (inside_distance(regions(t:t), x(plane), [1.0_wp, 1.0_wp]) < -radius - reach(t)) exit
        end do
        if (t > size(trims)) then
          last = 0
          return
        end if
        last = max(last, t)
      end do
    end do
  end subroutine find_last_cut

  !> Warn of curves to which nothing carries the sheet before their step.
  subroutine check_meeting(trim, element, reach, units, is_wrong, errors)
    type(trim_t), intent(in) :: trim
    class(element_t), intent(in) :: element
    real(wp), intent(in) :: reach                 !! of the sheet [length]
    character(*), intent(in) :: units             !! what *UNITS says
    logical, intent(out) :: is_wrong              !! there is a warning
    type(error_list_t), intent(inout) :: errors
    real(wp), allocatable :: met(:, :), off(:)
    character(:), allocatable :: remedy
    real(wp) :: low(2), high(2), x(3)
    integer :: p, i, plane(2)

    is_wrong = .false.
    plane = plane_of(trim%axis)
    low = [(minval(element%motion%x(:, :, :, plane(i))), i=1, 2)]
    high = [(maxval(element%motion%x(:, :, :, plane(i))), i=1, 2)]
    remedy = unit_hint(trim, element, units)
    if (remedy == "") remedy = "check units and DIRECTION"
    do p = 1, size(trim%polygons)
      associate (corners => trim%polygons(p)%corners)
        if (covers_box(corners, low - reach, high + reach) .and. size(trim%polygons) == 1) then
          is_wrong = .true.
          call add_warning(errors, trim%origins(p), "a curve around all of the sheet, which "// &
                           trim_word(trim%is_outside), "another curve or another KEEP; "//remedy)
        end if
        call cut_to_box(corners, low - reach, high + reach, met)
        if (size(met, 2) > 0) cycle
        is_wrong = .true.
        off = [(norm2(max(low - corners(:, i), corners(:, i) - high, 0.0_wp)), &
                i=1, size(corners, 2))]
        x = in_space(corners(:, minloc(off, 1)), plane)
      end associate
      call add_warning(errors, trim%origins(p), "a curve that is "//rounded_text(minval(off))// &
                       " off the sheet at "//place_text(x)//"; before its step tools and "// &
                       "supports move the sheet by "//rounded_text(reach)//" at most", &
                       "a curve that meets the sheet; "//remedy)
    end do
  end subroutine check_meeting

  !> What a curve around all of the sheet does.
  pure function trim_word(is_outside) result(word)
    logical, intent(in) :: is_outside             !! what lies outside stays
    character(:), allocatable :: word

    word = "cuts nothing away"
    if (is_outside) word = "leaves nothing of it"
  end function trim_word

  !> Cut a copy of the sheet along the curves that lie on it as it is before the run.
  subroutine check_flat_trims(scene, model, is_reported, errors)
    type(scene_t), intent(in) :: scene
    type(model_t), intent(in) :: model
    logical, intent(inout) :: is_reported(:)      !! that what is watched is gone
    type(error_list_t), intent(inout) :: errors
    type(blank_t) :: blank
    type(error_t), allocatable :: error
    type(loss_t) :: loss
    integer :: t, i

    if (.not. any(model%trims%is_flat .and. model%trims%step > 1)) return
    blank = model%bodies%blank
    do t = 1, size(model%trims)
      associate (trim => model%trims(t), origin => scene%outlines(t)%origin)
        if (.not. trim%is_flat .or. trim%step <= 1) cycle
        call cut_blank(trim, blank, error, loss)
        if (allocated(error)) then
          call add_error(errors, origin, error%message, "curves that meet the sheet "// &
                         "and keep as many pieces of it as PIECES says")
          return
        end if
        if (.not. loss%share > 0.0_wp) call add_warning(errors, origin, &
          "curves that cut nothing away", "other curves, KEEP or DIRECTION")
        if (loss%slit%is_there) call add_warning(errors, origin, slit_words(loss%slit), &
                                                 slit_remedy(loss%slit))
        do i = 1, size(is_reported)
          if (is_reported(i) .or. model%watched(i)%last_step < trim%step) cycle
          is_reported(i) = is_gone(model%watched(i), blank%parts(1)%element)
          if (is_reported(i)) call warn_of_cut(model%watched(i), trim, errors)
        end do
      end associate
    end do
  end subroutine check_flat_trims

  subroutine warn_of_cut(watched, trim, errors)
    type(watched_t), intent(in) :: watched
    type(trim_t), intent(in) :: trim
    type(error_list_t), intent(inout) :: errors

    call add_warning(errors, watched%origin, watched%what//", which lies in what *TRIM, NAME="// &
                     trim%name//" in step "//to_text(trim%step)//" cuts away", &
                     "a place inside its curves, or nothing there from that step on")
  end subroutine warn_of_cut

  !> How far tools and supports may carry the sheet before a step: the sum of their ways. What loads
  !! and initial velocities do is not known; tools that a force moves press on the sheet.
  pure real(wp) function way_before(scene, step) result(way)
    type(scene_t), intent(in) :: scene
    integer, intent(in) :: step
    integer :: i

    way = 0.0_wp
    if (any(scene%loads%first_step < step) .or. size(scene%initial_velocities) > 0) way = unlimited
    do i = 1, size(scene%motions)
      associate (motion => scene%motions(i))
        if (motion%step >= step .or. motion%is_force) cycle
        if (motion%is_rotation) way = unlimited
        way = way + norm2(motion%vector)*largest_factor(scene, motion%curve) &
              *merge(1.0_wp, time_between(scene, motion%step, step), motion%is_displacement)
      end associate
    end do
    do i = 1, size(scene%boundaries)
      associate (support => scene%boundaries(i))
        if (support%first_step >= step) cycle
        way = way + norm2(support%velocity)*largest_factor(scene, support%curve) &
              *time_between(scene, support%first_step, step)
      end associate
    end do
  end function way_before

  !> Time from the start of a step to that of another.
  pure real(wp) function time_between(scene, first, step) result(time)
    type(scene_t), intent(in) :: scene
    integer, intent(in) :: first, step

    time = sum(scene%later_steps(max(1, first - 1):step - 2)%step%duration)
    if (first == 1) time = time + scene%step%duration
  end function time_between

  pure real(wp) function largest_factor(scene, curve) result(factor)
    type(scene_t), intent(in) :: scene
    integer, intent(in) :: curve                  !! 0: none

    factor = 1.0_wp
    if (curve > 0) factor = maxval(abs(scene%curves(curve)%values))
  end function largest_factor

  !> Do all places lie outside of a trim by more than a distance?
  logical function is_beyond(watched, trim, element, distance)
    type(watched_t), intent(in) :: watched
    type(trim_t), intent(in) :: trim
    class(element_t), intent(in) :: element
    real(wp), intent(in) :: distance              !! [length]
    type(region_t) :: regions(1)
    logical, allocatable :: counts(:, :)
    real(wp), allocatable :: lines1(:), lines2(:)
    real(wp) :: x(3)
    integer :: i, j, plane(2)

    plane = plane_of(trim%axis)
    call new_region(regions(1), trim%polygons, trim%is_outside)
    lines1 = breaks(element%grid%axes(1))
    lines2 = breaks(element%grid%axes(2))
    if (allocated(watched%points)) then
      counts = watched%points
      if (allocated(element%ties%is_free)) counts = counts .and. element%ties%is_free
    else
      counts = watched%elements
      if (allocated(element%ties%share)) counts = counts .and. element%ties%share > 0.0_wp
    end if
    is_beyond = .false.
    do j = 1, size(counts, 2)
      do i = 1, size(counts, 1)
        if (.not. counts(i, j)) cycle
        if (allocated(watched%points)) then
          x = element%motion%x(i, j, 1, :)
        else
          call evaluate_solid(element%grid, [0.5_wp*(lines1(i) + lines1(i + 1)), &
                                             0.5_wp*(lines2(j) + lines2(j + 1)), 0.5_wp], x)
        end if
        if (inside_distance(regions, x(plane), [1.0_wp, 1.0_wp]) >= -distance) return
      end do
    end do
    is_beyond = .true.
  end function is_beyond

end module outline_check
