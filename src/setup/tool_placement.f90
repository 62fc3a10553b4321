!> Tools placed against the sheet: moved along a direction until their smallest distance to it is a
!! given clearance.
!!
!! The tool starts on the far side of the sheet and advances by its distance less the clearance,
!! which it can never overshoot, until nothing is left (J. C. Hart, The Visual Computer 12, 1996).
module tool_placement
  use kinds, only: wp
  use failure, only: error_t, fail
  use text, only: to_text
  use nurbs_surface, only: nurbs_surface_t
  use nurbs_solid, only: nurbs_solid_t, solid_face
  use tool, only: tool_t
  use least_distance, only: distance_search_t, new_distance_search, find_least_distance, &
                            follow_least_distance
  implicit none
  private

  public :: placing_shift, sheet_distance

  integer, parameter :: n_faces = 6
  integer, parameter :: max_advances = 1000
  real(wp), parameter :: exact = 1.0e-12_wp       !! what is left, of the size of the scene
  real(wp), parameter :: coarse = 0.1_wp          !! of an advance, known no better while it is long

contains

  !> Way of a tool along `direction` from where it is to where its smallest distance to the sheet is
  !! `clearance`, coming from behind. Refused: a tool that passes the sheet farther away, and one
  !! that comes to no end.
  subroutine placing_shift(tool, solids, direction, clearance, shift, doubt, error)
    type(tool_t), intent(in) :: tool
    type(nurbs_solid_t), intent(in) :: solids(:)   !! patches of the sheet
    real(wp), intent(in) :: direction(3)           !! towards the sheet; not zero
    real(wp), intent(in) :: clearance              !! not negative [length]
    real(wp), intent(out) :: shift(3)              !! [length]
    real(wp), intent(out) :: doubt                 !! by which the distance may be less [length]
    type(error_t), allocatable, intent(out) :: error
    type(distance_search_t) :: search
    real(wp) :: unit(3), way, last, nearest, least, left
    logical :: is_close
    integer :: i

    unit = direction/norm2(direction)
    call new_distance_search(search, faces_of(solids), tool, reach=clearance)
    call find_ends(tool, solids, unit, way, last)
    way = way - clearance
    last = last + clearance
    least = huge(1.0_wp)
    is_close = .false.
    do i = 1, max_advances
      call find_least_distance(search, tool, way*unit, clearance, merge(0.0_wp, coarse, is_close), &
                               nearest, doubt)
      least = min(least, nearest)
      left = nearest - clearance
      if ((is_close .and. abs(left) <= exact*search%scale) .or. way > last) exit
      way = way + left
      if (.not. is_close .and. doubt < left) way = way - doubt
      is_close = left <= search%tolerance/coarse
      if (is_close) call settle(search, tool, unit, clearance, way)
    end do
    shift = way*unit
    if (way > last) then
      call fail(error, "tool "//tool%name//" passes the sheet at a distance of "//to_text(least))
    else if (abs(left) > 1000*exact*search%scale) then
      call fail(error, "tool "//tool%name//" does not come to rest at its clearance from the "// &
                "sheet; the last distance is "//to_text(nearest))
    end if
  end subroutine placing_shift

  !> Advance by what the place known to be nearest leaves, until that is nothing or round-off keeps
  !! it from becoming less.
  subroutine settle(search, tool, unit, clearance, way)
    type(distance_search_t), intent(inout) :: search
    type(tool_t), intent(in) :: tool
    real(wp), intent(in) :: unit(3), clearance
    real(wp), intent(inout) :: way
    real(wp) :: nearest, left, before
    integer :: i

    before = huge(1.0_wp)
    do i = 1, max_advances
      call follow_least_distance(search, tool, way*unit, nearest)
      left = abs(nearest - clearance)
      if (left <= 0.5_wp*exact*search%scale .or. left >= before) exit
      before = left
      way = way + nearest - clearance
    end do
  end subroutine settle

  !> Ways along a direction where the foremost corner of the box around a tool meets the hindmost
  !! control point of the sheet, and where its hindmost one leaves the foremost one.
  pure subroutine find_ends(tool, solids, unit, first, last)
    type(tool_t), intent(in) :: tool
    type(nurbs_solid_t), intent(in) :: solids(:)
    real(wp), intent(in) :: unit(3)
    real(wp), intent(out) :: first, last           !! [length]
    real(wp) :: front, rear
    integer :: p

    front = dot_product(merge(tool%box(:, 2), tool%box(:, 1), unit > 0.0_wp), unit)
    rear = dot_product(merge(tool%box(:, 1), tool%box(:, 2), unit > 0.0_wp), unit)
    first = huge(1.0_wp)
    last = -huge(1.0_wp)
    do p = 1, size(solids)
      associate (x => solids(p)%points)
        first = min(first, minval(unit(1)*x(:, :, :, 1) + unit(2)*x(:, :, :, 2) &
                                  + unit(3)*x(:, :, :, 3)))
        last = max(last, maxval(unit(1)*x(:, :, :, 1) + unit(2)*x(:, :, :, 2) &
                                + unit(3)*x(:, :, :, 3)))
      end associate
    end do
    first = first - front
    last = last - rear
  end subroutine find_ends

  !> Smallest distance between a tool where it is and the sheet.
  real(wp) function sheet_distance(tool, solids) result(distance)
    type(tool_t), intent(in) :: tool
    type(nurbs_solid_t), intent(in) :: solids(:)   !! patches of the sheet
    type(distance_search_t) :: search
    real(wp) :: doubt

    call new_distance_search(search, faces_of(solids), tool)
    call find_least_distance(search, tool, [0.0_wp, 0.0_wp, 0.0_wp], 0.0_wp, 0.0_wp, distance, &
                             doubt)
  end function sheet_distance

  !> All faces of all patches.
  pure function faces_of(solids) result(faces)
    type(nurbs_solid_t), intent(in) :: solids(:)
    type(nurbs_surface_t) :: faces(n_faces*size(solids))
    integer :: p, f

    do p = 1, size(solids)
      do f = 1, n_faces
        faces(f + n_faces*(p - 1)) = solid_face(solids(p), f)
      end do
    end do
  end function faces_of

end module tool_placement
