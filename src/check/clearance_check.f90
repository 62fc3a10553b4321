!> Tools on both sides of the sheet that run into each other, or leave it less room than its
!! thickness.
module clearance_check
  use kinds, only: wp
  use text, only: rounded_text, place_text
  use input_errors, only: origin_t, error_list_t, add_warning, has_error_at
  use scene, only: scene_t
  use model, only: model_t
  use tool, only: tool_t
  use closest_point, only: hit_t, is_beside
  use tool_search, only: search_all_faces
  use sheet_target, only: sheet_target_t, new_sheet_target, is_over
  use sweep, only: frame_t, path_t, position_at, break_times, in_space, in_tool, moved_by
  use tool_points, only: tool_point_t, inner_points, foot
  use travel, only: force_motion
  use reach_check, only: encounter_t, identity
  implicit none
  private

  public :: check_clearance

  real(wp), parameter :: least_room = 0.9_wp  !! of the thickness, that is no mistake
  real(wp), parameter :: facing = 0.5_wp      !! cosine between surfaces that face each other
  real(wp), parameter :: squeezed = 1.0e-3_wp !! closed by more, of the thickness: on purpose
  real(wp), parameter :: deep = 3.0_wp        !! overlap beyond it, of the thickness: another side
  real(wp), parameter :: sideways = 0.8_wp    !! part of a stroke: where more of it is too much ...
  real(wp), parameter :: head_on = 0.9_wp     !! ... and this cosine is smaller, it is not too long
  integer, parameter :: n_intervals = 32      !! of the time of a step of the deck
  integer, parameter :: n_halvings = 30       !! of a time

  real(wp), parameter :: everywhere(3, 2) = reshape(1.0e30_wp*[-1, -1, -1, 1, 1, 1], [3, 2])

  !> Where two tools leave the sheet least room.
  type :: tightest_t
    real(wp) :: clearance = huge(1.0_wp)      !! less than 0: they overlap [length]
    real(wp) :: x(3) = 0.0_wp                 !! where it is
    real(wp) :: time = 0.0_wp
    integer :: on = 1                         !! tool of the two that has the point
    real(wp) :: point(3) = 0.0_wp             !! in the frame of this tool
    real(wp) :: excess = 0.0_wp               !! how far it moves on, after the clearance was the
                                              !! thickness; 0: along the other tool [length]
    real(wp) :: slope = 1.0_wp                !! cosine of that way and the normal
    real(wp) :: squeeze = 0.0_wp              !! closer than the thickness and the start [length]
  end type tightest_t

  !> A point of one tool, and its distance from the other when it was last searched.
  type :: rider_t
    integer :: on = 1
    type(tool_point_t) :: point
    real(wp) :: seen(3) = 1.0e30_wp           !! then, in the frame of the other tool
    real(wp) :: distance = 0.0_wp             !! [length]
  end type rider_t

  !> Two tools and their paths.
  type :: meeting_t
    type(tool_t) :: tools(2)
    type(path_t) :: paths(2)
    type(rider_t), allocatable :: riders(:)
  end type meeting_t

contains

  !> Warn of each pair of tools that prescribed motions bring too close. `is_squeezed`: some tools
  !! close on the sheet from both sides, if only a little.
  subroutine check_clearance(scene, model, encounters, thickness, errors, is_squeezed)
    type(scene_t), intent(in) :: scene
    type(model_t), intent(in) :: model
    type(encounter_t), intent(in) :: encounters(:)
    real(wp), intent(in) :: thickness         !! of the blank [length]
    type(error_list_t), intent(inout) :: errors
    logical, intent(out), optional :: is_squeezed
    type(sheet_target_t) :: target
    type(tightest_t) :: tightest
    real(wp) :: period(2)
    integer :: i, j

    if (present(is_squeezed)) is_squeezed = .false.
    do i = 1, size(encounters)
      do j = 1, size(encounters)
        if (.not. can_meet(scene, encounters, i, j)) cycle
        if (has_error_at(errors, scene%tools(encounters(i)%tool)%origin) .or. &
            has_error_at(errors, scene%tools(encounters(j)%tool)%origin)) cycle
        period = common_time(encounters(i), encounters(j))
        if (period(1) >= period(2)) cycle
        if (target%face == 0) call new_sheet_target(model%bodies%blank, encounters(i)%face, &
                                                    thickness, target)
        associate (a => encounters(i), b => encounters(j), tools => model%bodies%tools)
          call find_tightest(tools(a%tool), a%path, tools(b%tool), b%path, period, target, tightest)
          if (tightest%clearance < least_room*thickness) &
            call report(scene, a, b, tightest, thickness, errors)
          if (present(is_squeezed)) &
            is_squeezed = is_squeezed .or. tightest%squeeze > squeezed*thickness
        end associate
      end do
    end do
  end subroutine check_clearance

  !> Is i at the bottom of the sheet and j at the top, only there, and is one of them moved? A tool
  !! that a force moves follows the sheet.
  pure logical function can_meet(scene, encounters, i, j)
    type(scene_t), intent(in) :: scene
    type(encounter_t), intent(in) :: encounters(:)
    integer, intent(in) :: i, j
    integer, parameter :: bottom = 5, top = 6
    integer :: a, b, k

    a = encounters(i)%tool
    b = encounters(j)%tool
    can_meet = encounters(i)%face == bottom .and. encounters(j)%face == top .and. &
               .not. (encounters(i)%path%is_still .and. encounters(j)%path%is_still) .and. &
               force_motion(scene, a) == 0 .and. force_motion(scene, b) == 0
    do k = 1, size(encounters)
      if (encounters(k)%tool == a) can_meet = can_meet .and. encounters(k)%face /= top
      if (encounters(k)%tool == b) can_meet = can_meet .and. encounters(k)%face /= bottom
    end do
  end function can_meet

  !> From when to when both tools may touch the blank.
  pure function common_time(a, b) result(period)
    type(encounter_t), intent(in) :: a, b
    real(wp) :: period(2)
    integer :: first, last

    first = max(a%first_step, b%first_step)
    last = min(a%last_step, b%last_step)
    period = 0.0_wp
    if (first > last) return
    period = [a%path%starts(first)%time, a%path%end_time]
    if (last < size(a%path%starts)) period(2) = a%path%starts(last + 1)%time
  end function common_time

  !> Follow two tools, and find where they come closest, face to face above the blank as it lies at
  !! the start. Where they are as close from the start on, nothing is found.
  subroutine find_tightest(tool_a, path_a, tool_b, path_b, period, target, tightest)
    type(tool_t), intent(in) :: tool_a, tool_b
    type(path_t), intent(in) :: path_a, path_b
    real(wp), intent(in) :: period(2)         !! time from and to
    type(sheet_target_t), intent(in) :: target   !! a face of the blank
    type(tightest_t), intent(out) :: tightest
    type(meeting_t) :: meeting
    type(frame_t) :: frames(2)
    type(tightest_t) :: at_start
    real(wp), allocatable :: breaks(:)
    real(wp) :: least, squeeze

    meeting%tools(1) = tool_a
    meeting%tools(2) = tool_b
    meeting%paths(1) = path_a
    meeting%paths(2) = path_b
    meeting%riders = [riders_of(tool_a, path_a, target, 1), riders_of(tool_b, path_b, target, 2)]
    breaks = [break_times(path_a), break_times(path_b), period(2)]
    frames = positions(meeting, period(1))
    call look(meeting, frames, target, least, at_start)
    do while (frames(1)%time < period(2) .and. tightest%clearance > 0.0_wp)
      frames = next_positions(meeting, frames, breaks, max(least, target%thickness))
      call look(meeting, frames, target, least, tightest)
    end do
    if (tightest%clearance >= huge(1.0_wp)) return
    if (tightest%clearance > 0.0_wp) call refine(meeting, target, tightest)
    squeeze = min(at_start%clearance, target%thickness) - tightest%clearance
    if (tightest%clearance > at_start%clearance - (1.0_wp - least_room)*target%thickness) then
      tightest = tightest_t()
    else
      call find_excess(meeting, period, target%thickness, tightest)
    end if
    tightest%squeeze = squeeze
  end subroutine find_tightest

  !> Points of a tool that come above a flat blank; of all of the tool where it turns.
  function riders_of(tool, path, target, on) result(riders)
    type(tool_t), intent(in) :: tool
    type(path_t), intent(in) :: path
    type(sheet_target_t), intent(in) :: target
    integer, intent(in) :: on
    type(rider_t), allocatable :: riders(:)
    integer, parameter :: n_samples = 16
    type(tool_point_t), allocatable :: points(:)
    type(frame_t) :: start, frame
    real(wp) :: box(3, 2)
    integer :: k

    start = position_at(path, 0.0_wp)
    box(:, 1) = target%surface%box(:, 1) - start%displacement
    box(:, 2) = target%surface%box(:, 2) - start%displacement
    do k = 1, n_samples
      frame = position_at(path, k*path%end_time/n_samples)
      box(:, 1) = min(box(:, 1), target%surface%box(:, 1) - frame%displacement)
      box(:, 2) = max(box(:, 2), target%surface%box(:, 2) - frame%displacement)
      if (any(abs(frame%rotation - identity()) > 0.0_wp)) box = everywhere
    end do
    ! The formed sheet reaches higher and lower than the blank.
    associate (extent => target%surface%box(:, 2) - target%surface%box(:, 1))
      k = minloc(extent, 1)
      box(k, :) = everywhere(k, :)
      if (extent(k) > target%thickness) box = everywhere
    end associate
    points = inner_points(tool, box)
    allocate (riders(size(points)))
    riders%on = on
    riders%point = points
  end function riders_of

  function positions(meeting, time) result(frames)
    type(meeting_t), intent(in) :: meeting
    real(wp), intent(in) :: time
    type(frame_t) :: frames(2)

    frames(1) = position_at(meeting%paths(1), time)
    frames(2) = position_at(meeting%paths(2), time)
  end function positions

  !> The next positions, none beyond the next jump of a velocity, moved by no more than `room`.
  function next_positions(meeting, frames, breaks, room) result(next)
    type(meeting_t), intent(in) :: meeting
    type(frame_t), intent(in) :: frames(2)
    real(wp), intent(in) :: breaks(:), room
    type(frame_t) :: next(2)
    real(wp) :: dt, until
    integer :: i

    associate (path => meeting%paths(1), now => frames(1))
      until = path%end_time
      if (now%step < size(path%starts)) until = path%starts(now%step + 1)%time
      dt = (until - path%starts(now%step)%time)/n_intervals
      until = minval(breaks, breaks > now%time)
      do i = 1, n_halvings
        next = positions(meeting, min(now%time + dt, until))
        if (moved_by(meeting%tools(1), frames(1), next(1)) + &
            moved_by(meeting%tools(2), frames(2), next(2)) <= room) exit
        dt = 0.5_wp*dt
      end do
    end associate
  end function next_positions

  !> Search from the points that may have come closer than the thickness.
  subroutine look(meeting, frames, target, least, tightest)
    type(meeting_t), intent(inout) :: meeting
    type(frame_t), intent(in) :: frames(2)
    type(sheet_target_t), intent(in) :: target
    real(wp), intent(out) :: least            !! way that leaves all points farther [length]
    type(tightest_t), intent(inout) :: tightest
    type(hit_t) :: hit
    real(wp) :: x(3), y(3), moved
    integer :: k

    least = huge(1.0_wp)
    do k = 1, size(meeting%riders)
      associate (rider => meeting%riders(k))
        associate (own => frames(rider%on), other => frames(3 - rider%on))
          x = in_space(own, rider%point%x)
          y = in_tool(other, x)
          moved = norm2(y - rider%seen)
          if (moved > 0.0_wp .and. rider%distance - moved <= target%thickness) then
            call search_all_faces(meeting%tools(3 - rider%on), y, hit)
            rider%seen = y
            rider%distance = hit%distance
            moved = 0.0_wp
            if (is_closer(meeting, rider, frames, hit, target, tightest)) &
              tightest = tightest_t(hit%gap, x, own%time, rider%on, rider%point%x)
          end if
          least = min(least, rider%distance - moved - target%thickness)
        end associate
      end associate
    end do
  end subroutine look

  !> Does a point face the other tool closer than is known, within the outline of the blank?
  logical function is_closer(meeting, rider, frames, hit, target, tightest)
    type(meeting_t), intent(in) :: meeting
    type(rider_t), intent(in) :: rider
    type(frame_t), intent(in) :: frames(2)
    type(hit_t), intent(in) :: hit            !! on the other tool
    type(sheet_target_t), intent(in) :: target
    type(tightest_t), intent(in) :: tightest

    is_closer = hit%gap < min(tightest%clearance, target%thickness) .and. &
                hit%gap > -deep*target%thickness
    if (is_closer) is_closer = .not. is_beside(meeting%tools(3 - rider%on), hit, 0.0_wp)
    if (is_closer) is_closer = &
      dot_product(matmul(frames(rider%on)%rotation, rider%point%normal), &
                  matmul(frames(3 - rider%on)%rotation, hit%normal)) < -facing
    if (is_closer) is_closer = is_over(target, in_space(frames(rider%on), rider%point%x))
  end function is_closer

  !> Go to the closest points of the two surfaces, from one to the other and back; the ways shrink
  !! by about the same factor, whose limit is tried next.
  subroutine refine(meeting, target, tightest)
    type(meeting_t), intent(in) :: meeting
    type(sheet_target_t), intent(in) :: target
    type(tightest_t), intent(inout) :: tightest
    integer, parameter :: n_turns = 6
    real(wp), parameter :: slowest = 0.99_wp   ! factor
    type(frame_t) :: frames(2)
    type(hit_t) :: hit
    real(wp) :: x(3, 0:2), way(3, 2), point(3), factor
    integer :: i, k

    frames = positions(meeting, tightest%time)
    associate (a => meeting%tools(tightest%on), b => meeting%tools(3 - tightest%on), &
               own => frames(tightest%on), other => frames(3 - tightest%on))
      x(:, 0) = tightest%x
      do i = 1, n_turns
        do k = 1, 2
          call search_all_faces(b, in_tool(other, x(:, k - 1)), hit)
          call search_all_faces(a, in_tool(own, in_space(other, foot(b, hit))), hit)
          point = foot(a, hit)
          x(:, k) = in_space(own, point)
        end do
        call search_all_faces(b, in_tool(other, x(:, 2)), hit)
        if (is_beside(b, hit, 0.0_wp) .or. hit%gap >= tightest%clearance) exit
        if (.not. is_over(target, x(:, 2))) exit
        tightest%x = x(:, 2)
        tightest%point = point
        tightest%clearance = hit%gap
        way = x(:, 1:2) - x(:, 0:1)
        factor = dot_product(way(:, 1), way(:, 2))/max(sum(way(:, 1)**2), tiny(1.0_wp))
        factor = min(max(factor, 0.0_wp), slowest)
        x(:, 0) = x(:, 2) + factor/(1 - factor)*way(:, 2)
      end do
    end associate
  end subroutine refine

  !> How far the point moves on against the other tool after the clearance was the thickness.
  subroutine find_excess(meeting, period, thickness, tightest)
    type(meeting_t), intent(in) :: meeting
    real(wp), intent(in) :: period(2), thickness
    type(tightest_t), intent(inout) :: tightest
    integer, parameter :: n_samples = 64
    type(hit_t) :: hit
    real(wp) :: clear, close, y(3), deepest, normal(3), way(3)
    integer :: i

    call search_all_faces(meeting%tools(3 - tightest%on), place_at(tightest%time), hit)
    normal = hit%normal
    clear = period(1)
    close = tightest%time
    do i = 1, n_halvings
      call search_all_faces(meeting%tools(3 - tightest%on), &
                            place_at(0.5_wp*(clear + close)), hit)
      if (hit%gap >= thickness) clear = 0.5_wp*(clear + close)
      if (hit%gap < thickness) close = 0.5_wp*(clear + close)
    end do
    y = place_at(close)
    deepest = 0.5_wp*(thickness - tightest%clearance)
    do i = 0, n_samples
      way = y - place_at(merge(tightest%time, close + (period(2) - close)*i/n_samples, i == 0))
      if (dot_product(way, normal) <= deepest) cycle
      deepest = dot_product(way, normal)
      tightest%excess = norm2(way)
      tightest%slope = dot_product(way, normal)/norm2(way)
    end do
  contains

    !> In the frame of the other tool.
    function place_at(time) result(place)
      real(wp), intent(in) :: time
      real(wp) :: place(3)
      type(frame_t) :: frames(2)

      frames = positions(meeting, time)
      place = in_tool(frames(3 - tightest%on), in_space(frames(tightest%on), tightest%point))
    end function place_at

  end subroutine find_excess

  !> How far two tools move past each other from the start on, at steps of the deck [length].
  pure real(wp) function travel_of(a, b)
    type(encounter_t), intent(in) :: a, b
    type(frame_t) :: ends(2)
    real(wp) :: start(3)
    integer :: i

    start = a%path%starts(1)%displacement - b%path%starts(1)%displacement
    ends(1) = position_at(a%path, a%path%end_time)
    ends(2) = position_at(b%path, b%path%end_time)
    travel_of = norm2(ends(1)%displacement - ends(2)%displacement - start)
    do i = 1, size(a%path%starts)
      travel_of = max(travel_of, norm2(a%path%starts(i)%displacement &
                                       - b%path%starts(i)%displacement - start))
    end do
  end function travel_of

  !> At the motion that is too long, else at the tool that moves.
  subroutine report(scene, a, b, tightest, thickness, errors)
    type(scene_t), intent(in) :: scene
    type(encounter_t), intent(in) :: a, b
    type(tightest_t), intent(in) :: tightest
    real(wp), intent(in) :: thickness
    type(error_list_t), intent(inout) :: errors
    character(:), allocatable :: found, expected
    type(origin_t) :: origin
    type(frame_t) :: frame
    integer :: mover, k

    mover = merge(a%tool, b%tool, b%path%is_still)
    found = "the tools '"//scene%tools(mover)%name//"' and '"// &
            scene%tools(a%tool + b%tool - mover)%name//"', which "
    if (tightest%clearance > 0.0_wp) then
      found = found//"leave a clearance of "//rounded_text(tightest%clearance)
    else
      found = found//"run into each other"
    end if
    found = found//" at "//place_text(tightest%x)//", time "//rounded_text(tightest%time)// &
            ", where the sheet is "//rounded_text(thickness)//" thick"
    origin = scene%tools(mover)%origin
    expected = "a clearance of at least the thickness between their surfaces"
    if (tightest%excess > sideways*travel_of(a, b) .and. tightest%slope < head_on) then
      expected = expected//", which overlap for most of the stroke: tools of other sizes or "// &
                 "places"
    else if (tightest%excess > 0.0_wp) then
      found = found//": the stroke is too long by "//rounded_text(tightest%excess)
      expected = "a stroke that ends where the clearance is the thickness, unless it is to "// &
                 "squeeze the sheet"
      frame = position_at(a%path, tightest%time)
      do k = 1, size(scene%motions)
        if (scene%motions(k)%tool == mover .and. scene%motions(k)%step <= frame%step) &
          origin = scene%motions(k)%origin
      end do
    end if
    call add_warning(errors, origin, found, expected)
  end subroutine report

end module clearance_check
