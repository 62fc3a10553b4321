!> Motions of tools that no forming has: far shorter than the sheet is thick, far longer than the
!! blank; and tools that are removed while they should act.
module motion_check
  use kinds, only: wp
  use text, only: rounded_text, to_text
  use input_errors, only: error_list_t, add_warning
  use scene, only: scene_t
  use support_extent, only: find_box, held_ends
  use model, only: model_t
  use sweep, only: path_t, path_of
  use travel, only: is_formed_by_strokes
  use stroke_check, only: stroke_t, stroke_of
  implicit none
  private

  public :: check_travels, check_removals

  real(wp), parameter :: thin = 20.0_wp       !! thicknesses that a sheet is long at least
  real(wp), parameter :: least = 1.0e-6_wp    !! of the thickness: less is no motion at all
  real(wp), parameter :: far = 1.5_wp         !! of the diagonal of the whole blank

contains

  !> Warn of strokes of another size than the blank, as from a velocity that is given as a
  !! displacement, or from another unit.
  subroutine check_travels(scene, model, thickness, is_squeezed, errors)
    type(scene_t), intent(in) :: scene
    type(model_t), intent(in) :: model
    real(wp), intent(in) :: thickness         !! of the blank [length]
    logical, intent(in) :: is_squeezed        !! between tools, by strokes that are short therefore
    type(error_list_t), intent(inout) :: errors
    real(wp) :: way(size(scene%tools)), sizes(3)
    integer :: t, k

    sizes = whole_sizes(scene)
    way = [(way_of(scene, model, t), t=1, size(way))]
    do t = 1, size(way)
      k = first_motion(scene, t)
      if (k > 0 .and. way(t) > far*norm2(sizes)) call add_warning(errors, &
        scene%motions(k)%origin, "a motion of the tool '"//scene%tools(t)%name//"' by "// &
        rounded_text(way(t))//" in all, where the blank is "//rounded_text(maxval(sizes))// &
        " long", "a stroke of the size of the blank; "//words_for(scene, k))
    end do
    if (size(way) == 0 .or. is_squeezed .or. any(scene%motions%is_rotation)) return
    if (.not. is_formed_by_strokes(scene)) return
    ! A block that is not thin may be pressed by less than its height.
    if (maxval(sizes) < thin*thickness) return
    t = maxloc(way, 1)
    k = first_motion(scene, t)
    if (k == 0 .or. way(t) >= thickness .or. way(t) <= least*thickness) return
    call add_warning(errors, scene%motions(k)%origin, "a motion of the tool '"// &
                     scene%tools(t)%name//"' by "//rounded_text(way(t))//" in all, and no tool "// &
                     "that moves farther, where the sheet is "//rounded_text(thickness)// &
                     " thick", "a stroke longer than that; "//words_for(scene, k))
  end subroutine check_travels

  !> What the numbers of a motion mean.
  pure function words_for(scene, k) result(words)
    type(scene_t), intent(in) :: scene
    integer, intent(in) :: k                  !! motion of the scene
    character(:), allocatable :: words

    words = "the vector is a velocity, to be multiplied by amplitude and time "// &
            "(TYPE=DISPLACEMENT for a stroke)"
    if (scene%motions(k)%is_displacement) words = "the vector times the amplitude is the stroke"
  end function words_for

  !> Sizes of the blank along x, y, z, with its mirror images.
  function whole_sizes(scene) result(sizes)
    type(scene_t), intent(in) :: scene
    real(wp) :: sizes(3), low(3), high(3)
    integer :: c

    call find_box(scene, low, high)
    do c = 1, 3
      sizes(c) = high(c) - low(c)
      if (count(held_ends(scene, c, c)) == 1) sizes(c) = 2*sizes(c)
    end do
  end function whole_sizes

  !> Extent of the travel of a tool while it may touch the blank [length]; 0 where it turns.
  real(wp) function way_of(scene, model, t) result(way)
    type(scene_t), intent(in) :: scene
    type(model_t), intent(in) :: model
    integer, intent(in) :: t                  !! the tool
    type(path_t) :: path
    type(stroke_t) :: stroke
    real(wp) :: low(3), high(3)
    integer :: c, step

    way = 0.0_wp
    if (any(scene%motions%tool == t .and. scene%motions%is_rotation)) return
    path = path_of(model, t)
    low = 0.0_wp
    high = 0.0_wp
    do step = 1, size(path%starts)
      if (.not. any(scene%contacts%tool == t .and. scene%contacts%last_step >= step)) exit
      do c = 1, 3
        stroke = stroke_of(path, step, c)
        low(c) = min(low(c), minval(stroke%values))
        high(c) = max(high(c), maxval(stroke%values))
      end do
    end do
    way = norm2(high - low)
  end function way_of

  !> The first *TOOL MOTION of a tool that has a vector; 0: none.
  pure integer function first_motion(scene, t) result(k)
    type(scene_t), intent(in) :: scene
    integer, intent(in) :: t

    do k = 1, size(scene%motions)
      if (scene%motions(k)%tool == t .and. .not. scene%motions(k)%is_force .and. &
          any(abs(scene%motions(k)%vector) > 0.0_wp)) return
    end do
    k = 0
  end function first_motion

  !> Warn of tools that are removed before they act, and of motions of tools that are removed.
  subroutine check_removals(scene, errors)
    type(scene_t), intent(in) :: scene
    type(error_list_t), intent(inout) :: errors
    integer :: t, k, last

    do t = 1, size(scene%tools)
      if (.not. any(scene%contacts%tool == t)) cycle
      if (any(scene%contacts%tool == t .and. &
              scene%contacts%last_step >= scene%contacts%first_step)) cycle
      call add_warning(errors, scene%tools(t)%origin, "the tool '"//scene%tools(t)%name// &
                       "', which is removed in step 1, before it acts", &
                       "*MODEL CHANGE, REMOVE in a step after those in which it acts, or ADD "// &
                       "in a later one")
    end do
    do k = 1, size(scene%motions)
      associate (motion => scene%motions(k))
        if (.not. any(abs(motion%vector) > 0.0_wp)) cycle
        if (.not. any(scene%contacts%tool == motion%tool .and. &
                      scene%contacts%last_step >= scene%contacts%first_step)) cycle
        ! One that is added later is brought to its place.
        if (any(scene%contacts%tool == motion%tool .and. &
                scene%contacts%first_step > motion%step)) cycle
        last = minval([1 + size(scene%later_steps), pack(scene%motions%step - 1, &
                       scene%motions%tool == motion%tool .and. scene%motions%step > motion%step)])
        if (any(scene%contacts%tool == motion%tool .and. scene%contacts%first_step <= last .and. &
                scene%contacts%last_step >= motion%step)) cycle
        call add_warning(errors, motion%origin, "a motion of the tool '"// &
                         scene%tools(motion%tool)%name//"' in step "//to_text(motion%step)// &
                         ", in which it is removed", "a motion in a step in which the tool acts")
      end associate
    end do
  end subroutine check_removals

end module motion_check
