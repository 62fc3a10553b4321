!> How a tool comes to the blank that lies as at the start: how near, when they first touch, which
!! way the tool looks, and where an edge of the tool meets the sheet inside its outline.
module approach
  use kinds, only: wp
  use tool, only: tool_t
  use closest_point, only: hit_t, is_beside
  use tool_search, only: search_all_faces
  use sheet_target, only: sheet_target_t
  use sweep, only: frame_t, path_t, position_at, moved_by, in_space, in_tool
  use tool_points, only: tool_point_t, inner_points, border_points, length_along, foot
  implicit none
  private

  public :: approach_t, edge_t, find_approach, rest_on_sheet

  !> A point of an edge of a tool where it touches the sheet, flat on it.
  type :: edge_t
    real(wp) :: overhang = 0.0_wp             !! length of the blank beyond it [length]; 0: none
    real(wp) :: x(3) = 0.0_wp
    real(wp) :: outward(3) = 0.0_wp           !! unit vector out of the tool
    real(wp) :: normal(3) = 0.0_wp            !! of the tool, towards the sheet
    real(wp) :: time = 0.0_wp
  end type edge_t

  !> What a tool and a face of the blank do to each other. Distances are those of sampled points.
  type :: approach_t
    logical :: has_touched = .false.
    type(frame_t) :: first                    !! position of the tool at the first touch
    real(wp) :: contact(3) = 0.0_wp           !! where that is
    real(wp) :: at_start = huge(1.0_wp)       !! distance at the start [length]
    real(wp) :: least = huge(1.0_wp)          !! smallest distance of all positions [length]
    real(wp) :: toward(3) = 0.0_wp            !! unit vector from the blank to the tool there
    type(frame_t) :: nearest                  !! position that has it
    logical :: is_pressed = .false.           !! some position is inside the blank
    real(wp) :: at_end = 0.0_wp               !! distance at the last position [length]
    logical :: is_leaving = .false.           !! there is a gap then, and there was none smaller
    real(wp) :: toward_end(3) = 0.0_wp        !! unit vector from the blank to the tool there
    logical :: is_beside = .true.             !! the two never lie above each other
    logical :: is_behind = .false.            !! at the start the sheet lies behind the tool
    logical :: is_averted = .false.           !! the face looks away from the tool
    type(edge_t), allocatable :: edges(:)     !! points of edges of the tool
  end type approach_t

  real(wp), parameter :: touch = 0.1_wp       !! gap, of the thickness, that counts as touching
  real(wp), parameter :: near = 0.25_wp       !! further away, that an edge may be to touch too
  real(wp), parameter :: flat = 0.5_wp        !! cosine between the tool at its edge and the sheet
  integer, parameter :: n_intervals = 32      !! of the time of a step of the deck
  integer, parameter :: n_halvings = 30       !! of the time between two positions
  real(wp), parameter :: short = 0.5_wp       !! travel near the sheet, of its thickness
  real(wp), parameter :: through = 3.0_wp     !! travel after the first touch, not through the sheet

contains

  !> Follow a tool along its path until it would be pressed into the blank. Far from the blank it
  !! moves by no more than the distance at once, near it by half a thickness.
  subroutine find_approach(tool, path, target, approach)
    type(tool_t), intent(in) :: tool
    type(path_t), intent(in) :: path
    type(sheet_target_t), intent(in) :: target
    type(approach_t), intent(out) :: approach
    type(tool_point_t), allocatable :: points(:), border(:), sheet(:)
    type(frame_t) :: frame, before
    real(wp) :: gap, place(3), away(3)

    border = border_points(tool)
    points = [inner_points(tool), border]
    sheet = [inner_points(target%surface), border_points(target%surface)]
    allocate (approach%edges(size(border)))
    frame = position_at(path, 0.0_wp)
    before = frame
    call find_sides(tool, frame, sheet, target, approach)
    do
      call find_gap(tool, points, sheet, frame, target, gap, place, away)
      call note_distance(away, frame, approach)
      approach%is_beside = approach%is_beside .and. gap >= huge(1.0_wp)
      if (gap < -touch*target%thickness) then
        approach%is_pressed = .true.
        if (approach%has_touched .or. .not. frame%time > 0.0_wp) exit
        call step_back(tool, points, sheet, path, before, target, frame, gap, place)
      end if
      if (gap <= touch*target%thickness) then
        if (.not. approach%has_touched) then
          approach%first = frame
          approach%contact = place
          approach%has_touched = .true.
        end if
        call check_border(border, frame, gap, target, approach%edges)
      end if
      if (approach%is_pressed .or. path%is_still .or. frame%time >= path%end_time) exit
      before = frame
      frame = next_position(tool, path, before, norm2(away), approach%has_touched, target%thickness)
    end do
    approach%is_leaving = .not. approach%is_pressed .and. gap > touch*target%thickness
  end subroutine find_approach

  !> Keep the distance if it is the smallest, and as the last one.
  pure subroutine note_distance(away, frame, approach)
    real(wp), intent(in) :: away(3)           !! from the blank to the tool [length]
    type(frame_t), intent(in) :: frame
    type(approach_t), intent(inout) :: approach
    real(wp) :: direction(3)

    direction = away/max(norm2(away), tiny(1.0_wp))
    if (.not. frame%time > 0.0_wp) approach%at_start = norm2(away)
    if (norm2(away) < approach%least) then
      approach%least = norm2(away)
      approach%toward = direction
      approach%nearest = frame
    end if
    approach%at_end = norm2(away)
    approach%toward_end = direction
  end subroutine note_distance

  !> The next position that is looked at.
  function next_position(tool, path, frame, distance, has_touched, thickness) result(next)
    type(tool_t), intent(in) :: tool
    type(path_t), intent(in) :: path
    type(frame_t), intent(in) :: frame
    real(wp), intent(in) :: distance, thickness   !! [length]
    logical, intent(in) :: has_touched
    type(frame_t) :: next
    real(wp) :: dt
    integer :: i

    dt = path%end_time
    if (frame%step < size(path%starts)) dt = path%starts(frame%step + 1)%time
    dt = (dt - path%starts(frame%step)%time)/n_intervals
    do i = 1, n_halvings
      next = position_at(path, min(frame%time + dt, path%end_time))
      if (moved_by(tool, frame, next) <= max(distance, merge(through, short, has_touched) &
                                             *thickness)) exit
      dt = 0.5_wp*dt
    end do
  end function next_position

  !> The position along a direction at which a tool that a force moves rests on the sheet. It is not
  !! found where the tool passes beside the sheet.
  subroutine rest_on_sheet(tool, direction, target, frame, way, is_found)
    type(tool_t), intent(in) :: tool
    real(wp), intent(in) :: direction(3)      !! unit vector
    type(sheet_target_t), intent(in) :: target
    type(frame_t), intent(in) :: frame        !! at the start
    real(wp), intent(out) :: way              !! to there [length]
    logical, intent(out) :: is_found
    integer, parameter :: most_advances = 200
    type(tool_point_t), allocatable :: points(:), sheet(:)
    type(frame_t) :: moved
    real(wp) :: gap, place(3), away(3)
    integer :: i

    points = [inner_points(tool), border_points(tool)]
    sheet = inner_points(target%surface)
    moved = frame
    way = 0.0_wp
    is_found = .false.
    do i = 1, most_advances
      call find_gap(tool, points, sheet, moved, target, gap, place, away)
      is_found = gap <= touch*target%thickness
      if (is_found .or. way > 4*(tool%scale + target%surface%scale)) exit
      way = way + max(norm2(away), short*target%thickness)
      moved%displacement = frame%displacement + way*direction
    end do
  end subroutine rest_on_sheet

  !> Smallest gap between points of the tool that face the sheet, or points of the sheet that face
  !! the tool, and the other; huge where neither lies above the other. And the shortest way from
  !! the sheet to the tool.
  subroutine find_gap(tool, points, sheet, frame, target, gap, place, away)
    type(tool_t), intent(in) :: tool
    type(tool_point_t), intent(in) :: points(:), sheet(:)
    type(frame_t), intent(in) :: frame
    type(sheet_target_t), intent(in) :: target
    real(wp), intent(out) :: gap              !! [length]
    real(wp), intent(out) :: place(3)         !! where it is
    real(wp), intent(out) :: away(3)          !! [length]
    type(hit_t) :: hit
    real(wp) :: x(3), distance
    integer :: i

    gap = huge(1.0_wp)
    distance = huge(1.0_wp)
    place = 0.0_wp
    away = 0.0_wp
    do i = 1, size(points)
      x = in_space(frame, points(i)%x)
      call search_all_faces(target%surface, x, hit)
      if (hit%distance < distance) then
        distance = hit%distance
        away = x - foot(target%surface, hit)
      end if
      if (is_beside(target%surface, hit, 0.0_wp)) cycle
      if (dot_product(matmul(frame%rotation, points(i)%normal), hit%normal) >= 0.0_wp) cycle
      call keep_least(hit%gap, x)
    end do
    do i = 1, size(sheet)
      call search_all_faces(tool, in_tool(frame, sheet(i)%x), hit)
      if (hit%distance < distance) then
        distance = hit%distance
        away = in_space(frame, foot(tool, hit)) - sheet(i)%x
      end if
      if (is_beside(tool, hit, 0.0_wp)) cycle
      if (dot_product(matmul(frame%rotation, hit%normal), sheet(i)%normal) >= 0.0_wp) cycle
      call keep_least(hit%gap, sheet(i)%x)
    end do
  contains

    !> A point far behind belongs to another side of the tool.
    subroutine keep_least(candidate, at)
      real(wp), intent(in) :: candidate, at(3)

      if (candidate >= gap .or. candidate < -3*target%thickness) return
      gap = candidate
      place = at
    end subroutine keep_least

  end subroutine find_gap

  !> Between a position where the tool is clear and one where it is in the sheet, the one where
  !! they touch.
  subroutine step_back(tool, points, sheet, path, before, target, frame, gap, place)
    type(tool_t), intent(in) :: tool
    type(tool_point_t), intent(in) :: points(:), sheet(:)
    type(path_t), intent(in) :: path
    type(frame_t), intent(in) :: before
    type(sheet_target_t), intent(in) :: target
    type(frame_t), intent(inout) :: frame
    real(wp), intent(out) :: gap, place(3)
    real(wp) :: clear, inside, away(3)
    integer :: i

    clear = before%time
    inside = frame%time
    do i = 1, n_halvings
      frame = position_at(path, 0.5_wp*(clear + inside))
      call find_gap(tool, points, sheet, frame, target, gap, place, away)
      if (abs(gap) <= touch*target%thickness) return
      if (gap > 0.0_wp) clear = frame%time
      if (gap < 0.0_wp) inside = frame%time
    end do
    gap = 0.0_wp
  end subroutine step_back

  !> At the start: whether the sheet lies behind the tool, and whether its face looks away from it.
  !! Of points halfway through the sheet those count that are nearest to the tool and not beside it.
  subroutine find_sides(tool, frame, sheet, target, approach)
    type(tool_t), intent(in) :: tool
    type(frame_t), intent(in) :: frame
    type(tool_point_t), intent(in) :: sheet(:)
    type(sheet_target_t), intent(in) :: target
    type(approach_t), intent(inout) :: approach
    type(hit_t) :: hits(size(sheet))
    logical :: is_near(size(sheet))
    real(wp) :: least
    integer :: i

    do i = 1, size(sheet)
      call search_all_faces(tool, in_tool(frame, sheet(i)%x - 0.5_wp*target%thickness &
                                          *sheet(i)%normal), hits(i))
      if (is_beside(tool, hits(i), 0.0_wp)) hits(i)%distance = huge(1.0_wp)
    end do
    least = minval(hits%distance)
    if (least >= huge(1.0_wp)) return
    is_near = hits%distance <= least + target%thickness
    approach%is_behind = all(pack(hits%gap, is_near) < 0.0_wp)
    approach%is_averted = all(pack([(dot_product(matmul(frame%rotation, hits(i)%normal), &
                                                 sheet(i)%normal), i=1, size(sheet))], &
                                   is_near) > flat)
  end subroutine find_sides

  !> Where an edge of the tool, flat on the sheet, touches it inside its outline.
  subroutine check_border(border, frame, gap, target, edges)
    type(tool_point_t), intent(in) :: border(:)
    type(frame_t), intent(in) :: frame
    real(wp), intent(in) :: gap               !! of the nearest point of the tool [length]
    type(sheet_target_t), intent(in) :: target
    type(edge_t), intent(inout) :: edges(:)
    type(hit_t) :: hit
    real(wp) :: x(3), overhang
    integer :: i

    do i = 1, size(border)
      x = in_space(frame, border(i)%x)
      call search_all_faces(target%surface, x, hit)
      if (hit%gap > gap + near*target%thickness) cycle
      if (dot_product(matmul(frame%rotation, border(i)%normal), hit%normal) > -flat) cycle
      overhang = length_along(target%surface, x, matmul(frame%rotation, border(i)%outward), &
                              target%thickness)
      if (overhang > edges(i)%overhang) edges(i) = edge_t(overhang, x, &
        matmul(frame%rotation, border(i)%outward), matmul(frame%rotation, border(i)%normal), &
        frame%time)
    end do
  end subroutine check_border

end module approach
