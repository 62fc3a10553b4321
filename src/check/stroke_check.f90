!> The travel of tools in each step, as `--check` prints it; strokes that are zero, that the end of
!! the step cuts off, or that continue after their amplitude.
module stroke_check
  use kinds, only: wp
  use text, only: string_t, rounded_text, to_text, append_text, counted
  use input_errors, only: origin_t, error_list_t, add_warning
  use unit_system, only: unit_system_t, new_unit_system, unit_of
  use scene, only: scene_t
  use model, only: model_t
  use rigid_motion, only: motion_term_t, factor_of
  use sweep, only: path_t, path_of, break_times
  implicit none
  private

  public :: stroke_t, stroke_of, add_stroke_lines, check_strokes

  integer, parameter :: rotation = 4          !! quantity after the three coordinates

  !> Start, turning points and end of one coordinate of a tool in a step, or of its rotation.
  type :: stroke_t
    real(wp), allocatable :: times(:)         !! of the run
    real(wp), allocatable :: values(:)        !! from the start of the run [length] or [degrees]
  end type stroke_t

  character(8), parameter :: names(4) = [character(8) :: "x", "y", "z", "rotation"]
  real(wp), parameter :: round_off = 1.0e-6_wp   !! of the range, below which nothing turns back
  ! Strokes that shake a sheet on its penalty springs are still a thousand times longer.
  real(wp), parameter :: no_stroke = 1.0e-6_wp   !! of the thickness
  real(wp), parameter :: no_speed = 1.0e-3_wp    !! of the greatest, that counts as at rest
  real(wp), parameter :: no_angle = 1.0e-6_wp    !! [degrees]
  real(wp), parameter :: missing = 0.05_wp       !! part of a stroke that counts as cut off
  integer, parameter :: n_parts = 16             !! of the time between two jumps of the velocity
  integer, parameter :: most_turns = 4           !! that are printed

contains

  !> Coordinate c of the displacement of a tool in a step, or the angle of its rotation (c = 4).
  pure function stroke_of(path, step, c) result(stroke)
    type(path_t), intent(in) :: path
    integer, intent(in) :: step, c
    type(stroke_t) :: stroke
    real(wp), allocatable :: times(:), values(:)
    real(wp) :: turn, slack
    integer :: i, n

    times = sample_times(path, step)
    values = [(value_at(path, step, c, times(i)), i=1, size(times))]
    slack = round_off*(maxval(values) - minval(values))
    stroke%times = times(1:1)
    stroke%values = values(1:1)
    do i = 2, size(times)
      n = size(stroke%values)
      if (abs(values(i) - stroke%values(n)) <= slack) cycle
      turn = -1.0_wp
      if (n > 1) turn = (values(i) - stroke%values(n))*(stroke%values(n) - stroke%values(n - 1))
      if (turn > 0.0_wp) then
        stroke%times(n) = times(i)
        stroke%values(n) = values(i)
      else
        stroke%times = [stroke%times, times(i)]
        stroke%values = [stroke%values, values(i)]
      end if
    end do
  end function stroke_of

  !> Times of a step between which the velocity has no jump, each part divided evenly.
  pure function sample_times(path, step) result(times)
    type(path_t), intent(in) :: path
    integer, intent(in) :: step
    real(wp), allocatable :: times(:), breaks(:)
    integer :: i, k

    breaks = break_times(path)
    breaks = pack(breaks, breaks >= path%starts(step)%time .and. breaks <= end_of(path, step))
    times = [((breaks(i) + k*(breaks(i + 1) - breaks(i))/n_parts, k=0, n_parts - 1), &
              i=1, size(breaks) - 1), breaks(size(breaks))]
  end function sample_times

  pure real(wp) function end_of(path, step) result(time)
    type(path_t), intent(in) :: path
    integer, intent(in) :: step

    time = path%end_time
    if (step < size(path%starts)) time = path%starts(step + 1)%time
  end function end_of

  !> One quantity of a tool at a time of a step. After a rotation, displacements count from the
  !! start of the motion.
  pure real(wp) function value_at(path, step, c, time) result(value)
    type(path_t), intent(in) :: path
    integer, intent(in) :: step, c
    real(wp), intent(in) :: time
    integer :: i

    value = 0.0_wp
    associate (motion => path%motions(step))
      if (c < rotation) then
        if (.not. any([(any(path%motions(i)%terms%is_rotation), i=1, step)])) &
          value = path%starts(step)%displacement(c) - path%starts(1)%displacement(c) &
                  - motion_since(path%starts(step)%time)
      end if
      value = value + motion_since(time)
    end associate
  contains

    !> Sum of the terms.
    pure real(wp) function motion_since(at) result(total)
      real(wp), intent(in) :: at
      integer :: k

      total = 0.0_wp
      do k = 1, size(path%motions(step)%terms)
        associate (term => path%motions(step)%terms(k))
          if (term%is_rotation .neqv. c == rotation) cycle
          if (term%is_rotation) total = total + size_of(term)*factor_of(term, at)
          if (.not. term%is_rotation) total = total + term%vector(c)*factor_of(term, at)
        end associate
      end do
    end function motion_since

  end function value_at

  !> Lines for `--check`: one for each tool and step in which it moves as the deck says.
  subroutine add_stroke_lines(scene, model, lines)
    type(scene_t), intent(in) :: scene
    type(model_t), intent(in) :: model
    type(string_t), allocatable, intent(inout) :: lines(:)
    type(path_t) :: path
    type(stroke_t) :: stroke
    character(:), allocatable :: words
    integer :: t, step, c

    do t = 1, size(scene%tools)
      path = path_of(model, t)
      do step = 1, size(path%starts)
        words = ""
        do c = 1, rotation
          stroke = stroke_of(path, step, c)
          if (size(stroke%values) == 1) cycle
          if (words /= "") words = words//"; "
          words = words//words_of(scene, stroke, c)
        end do
        if (words /= "") call append_text(lines, "travel           tool "//scene%tools(t)%name// &
                                          ", step "//to_text(step)//": "//words)
      end do
    end do
  end subroutine add_stroke_lines

  !> Such as: z from 0 to -40 mm at 0.003 s, to 0 mm at 0.005 s.
  function words_of(scene, stroke, c) result(words)
    type(scene_t), intent(in) :: scene
    type(stroke_t), intent(in) :: stroke
    integer, intent(in) :: c
    character(:), allocatable :: words, length, time
    type(unit_system_t) :: units
    integer :: i, n

    length = ""
    time = ""
    if (scene%units /= "") then
      units = new_unit_system(scene%units)
      length = " "//unit_of(units, "length")
      time = " "//unit_of(units, "time")
    end if
    if (c == rotation) length = " degrees"
    n = size(stroke%values)
    words = trim(names(c))//" from "//rounded_text(stroke%values(1))
    do i = 2, n
      if (i > most_turns .and. i < n) cycle
      if (i > most_turns) words = words//", "//counted(n - most_turns, "more turning point")
      if (i > 2) words = words//","
      words = words//" to "//rounded_text(stroke%values(i))//length//" at "// &
              rounded_text(stroke%times(i))//time
    end do
  end function words_of

  !> Warn of motions that come to nothing or do not fit their step.
  subroutine check_strokes(scene, model, thickness, errors)
    type(scene_t), intent(in) :: scene
    type(model_t), intent(in) :: model
    real(wp), intent(in) :: thickness         !! of the blank [length]
    type(error_list_t), intent(inout) :: errors
    type(path_t) :: path
    integer :: t, step, last, first

    do t = 1, size(scene%tools)
      path = path_of(model, t)
      do step = 1, size(path%starts)
        first = findloc(scene%motions%tool == t .and. scene%motions%step == step .and. &
                        .not. scene%motions%is_force, .true., dim=1)
        if (first == 0) cycle
        last = minval([size(path%starts), pack(scene%motions%step - 1, &
                                               scene%motions%tool == t .and. &
                                               scene%motions%step > step)])
        ! What a tool does after its removal does not matter.
        last = max(step, min(last, maxval(pack(scene%contacts%last_step, &
                                               scene%contacts%tool == t))))
        call check_size(scene, path, first, last, thickness, errors)
        call check_fit(scene, path, first, end_of(path, last), errors)
      end do
    end do
  end subroutine check_strokes

  !> Warn of a motion that moves nothing while it lasts.
  subroutine check_size(scene, path, first, last, thickness, errors)
    type(scene_t), intent(in) :: scene
    type(path_t), intent(in) :: path
    integer, intent(in) :: first              !! motion of the scene
    integer, intent(in) :: last               !! step in which it ends
    real(wp), intent(in) :: thickness
    type(error_list_t), intent(inout) :: errors
    type(stroke_t) :: stroke
    character(:), allocatable :: found
    real(wp) :: most(4)
    integer :: c, step

    associate (spec => scene%motions(first), terms => path%motions(scene%motions(first)%step)%terms)
      if (.not. any([(any(abs(terms(c)%vector) > 0.0_wp), c=1, size(terms))])) return
      most = 0.0_wp
      do step = spec%step, last
        do c = 1, rotation
          stroke = stroke_of(path, step, c)
          most(c) = max(most(c), maxval(stroke%values) - minval(stroke%values))
        end do
      end do
      if (any(most(:3) > no_stroke*thickness) .or. most(rotation) > no_angle) return
      found = "a motion of the tool '"//scene%tools(spec%tool)%name//"' by "// &
              rounded_text(maxval(most(:3)))//" in all"
      if (spec%curve > 0) then
        if (.not. any(abs(scene%curves(spec%curve)%values) > 0.0_wp)) &
          found = "a motion of the tool '"//scene%tools(spec%tool)%name// &
                  "' whose amplitude is zero throughout"
      end if
      call add_warning(errors, spec%origin, found, "an amplitude and a vector that move the tool")
    end associate
  end subroutine check_size

  !> Warn of a stroke that its step cuts off: a displacement that is still to come, or a velocity
  !! that would have come to rest later. And of a velocity that the deck gives up to a time, and
  !! that carries the tool farther after it than before.
  subroutine check_fit(scene, path, first, end_time, errors)
    type(scene_t), intent(in) :: scene
    type(path_t), intent(in) :: path
    integer, intent(in) :: first              !! motion of the scene
    real(wp), intent(in) :: end_time          !! of the motion
    type(error_list_t), intent(inout) :: errors
    real(wp) :: ends, before, done, whole
    integer :: k, n

    associate (spec => scene%motions(first), tool => scene%tools(scene%motions(first)%tool))
      do k = 1, size(path%motions(spec%step)%terms)
        associate (term => path%motions(spec%step)%terms(k))
          n = size(term%curve%values)
          if (n < 2 .or. .not. any(abs(term%vector) > 0.0_wp)) cycle
          ends = term%curve%start + term%curve%times(n)
          before = factor_of(term, path%starts(spec%step)%time)
          done = (factor_of(term, end_time) - before)*size_of(term)
          whole = (factor_of(term, ends) - before)*size_of(term)
          if (ends > end_time*(1.0_wp + round_off)) then
            if (.not. term%is_displacement .and. abs(term%curve%values(n)) > &
                no_speed*maxval(abs(term%curve%values))) cycle
            if (abs(whole - done) < missing*max(abs(whole), abs(done))) cycle
            call add_warning(errors, spec%origin, "a motion of the tool '"//tool%name// &
              "' that ends at "//rounded_text(end_time)//", before its amplitude does, at "// &
              rounded_text(ends)//": "//rounded_text(done)//" of "//rounded_text(whole), &
              "a step that lasts as long as the amplitude")
          else if (lasts(term)) then
            if (abs(done - whole) <= abs(whole)) cycle
            call add_warning(errors, spec%origin, "a motion of the tool '"//tool%name// &
              "' that continues after the end of its amplitude at "//rounded_text(ends)// &
              ", until "//rounded_text(end_time)//": "//rounded_text(done)//" instead of "// &
              rounded_text(whole), "an amplitude that ends with 0, or a step that ends with it")
          end if
        end associate
      end do
    end associate
  end subroutine check_fit

  !> Length of the vector of a term [length], of a rotation its angle [degrees].
  pure real(wp) function size_of(term)
    type(motion_term_t), intent(in) :: term

    size_of = norm2(term%vector)
    if (term%is_rotation) size_of = size_of*180.0_wp/acos(-1.0_wp)
  end function size_of

  !> Is it a velocity with a constant end that the deck gives a time for?
  pure logical function lasts(term)
    type(motion_term_t), intent(in) :: term
    integer :: n

    associate (values => term%curve%values)
      n = size(values)
      lasts = .not. term%is_displacement .and. n > 2 .and. abs(values(n)) > 0.0_wp
      if (lasts) lasts = abs(values(n) - values(n - 1)) <= 0.0_wp .and. &
                         any(abs(values - values(n)) > 0.0_wp)
    end associate
  end function lasts

end module stroke_check
