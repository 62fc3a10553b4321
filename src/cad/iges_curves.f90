!> Closed curves for outlines from an IGES file: lines (110), circular arcs (100), rational B-spline
!! curves (126) and composite curves (102) that stand for themselves, as polygons.
module iges_curves
  use kinds, only: wp
  use input_errors, only: origin_t, error_list_t, new_origin, add_error, n_errors
  use text, only: string_t, to_text, rounded_text, place_text, append_text, counted
  use nurbs_curve, only: nurbs_curve_t
  use trim_curve, only: trim_curve_t, spline_curves
  use outline, only: polygon_t
  use line_chains, only: curve_corners, chain_lines, chain_fault_t
  use iges_directory, only: entry_t, entry_name
  use iges_model, only: iges_model_t, read_iges_model, entry_origin, reject_entity
  use iges_selection, only: iges_request_t, length_factor
  use iges_surfaces, only: read_curve
  implicit none
  private

  public :: read_iges_loops

  integer, parameter :: curves_read(4) = [100, 102, 110, 126]
  integer, parameter :: curves_unread(4) = [104, 106, 112, 130]
  integer, parameter :: most_errors = 20
  real(wp), parameter :: open = 1.0e-4_wp       !! gap that is closed, of the extent of all curves
  real(wp), parameter :: near = 1.0e-8_wp       !! corners lie off curves by less, of the extent
  character(*), parameter :: hint = &
    "lines (110), arcs (100), B-spline curves (126) and composite curves (102) of these"

contains

  !> Polygons of the curves of a file, seen along an axis. With an error among the errors there are
  !! none.
  subroutine read_iges_loops(request, plane, loops, origins, report, errors)
    type(iges_request_t), intent(in) :: request       !! path, place and unit of it count
    integer, intent(in) :: plane(2)                   !! coordinates that are kept
    type(polygon_t), allocatable, intent(out) :: loops(:)   !! corners in the unit of the deck
    type(origin_t), allocatable, intent(out) :: origins(:)  !! of the first entity of each
    type(string_t), allocatable, intent(out) :: report(:)   !! lines for the log
    type(error_list_t), intent(inout) :: errors
    type(iges_model_t) :: model
    type(nurbs_curve_t), allocatable :: curves(:)
    type(polygon_t), allocatable :: lines(:)
    integer, allocatable :: taken(:)
    integer :: n_before

    n_before = n_errors(errors)
    allocate (loops(0), origins(0), report(0))
    model%file%errors = errors
    call read_iges_model(request%path, model)
    if (n_errors(model%file%errors) == n_before) call select_curves(model, taken)
    if (n_errors(model%file%errors) == n_before) call read_taken(model, taken, curves)
    if (n_errors(model%file%errors) == n_before) then
      call flatten(curves, plane, length_factor(model, request), lines)
      call close_lines(model, request, taken, lines, loops, origins)
    end if
    errors = model%file%errors
    if (n_errors(errors) > n_before) return
    call append_text(report, request%path//", lengths in "//model%global%unit//" times "// &
                     to_text(length_factor(model, request))//": "//counted(size(loops), &
                     "closed curve")//" of "//counted(size(taken), "entity", "entities")// &
                     left_out(model))
  end subroutine read_iges_loops

  !> Entries of the curves that stand for themselves.
  subroutine select_curves(model, taken)
    type(iges_model_t), intent(inout) :: model
    integer, allocatable, intent(out) :: taken(:)
    integer :: i

    allocate (taken(0))
    do i = 1, size(model%entries)
      if (is_seen(model%entries(i), curves_read)) taken = [taken, i]
      if (is_seen(model%entries(i), curves_unread)) call reject_entity(model, i, &
        "a curve of a kind that is not read", hint)
    end do
    if (size(taken) == 0 .and. model%is_valid) &
      call add_error(model%file%errors, new_origin(model%file%path, 0, "IGES"), &
                     "no curve for an outline"//left_out(model), hint//" that are to be seen "// &
                     "and stand for themselves")
  end subroutine select_curves

  !> How many curves are blanked, parts of other entities, or no geometry; empty if none is.
  function left_out(model) result(words)
    type(iges_model_t), intent(in) :: model
    character(:), allocatable :: words
    integer :: i, n(3)

    n = 0
    do i = 1, size(model%entries)
      associate (entry => model%entries(i))
        if (.not. any(entry%type == [curves_read, curves_unread])) cycle
        if (entry%is_blanked) then
          n(1) = n(1) + 1
        else if (entry%is_part) then
          n(2) = n(2) + 1
        else if (entry%purpose /= 0) then
          n(3) = n(3) + 1
        end if
      end associate
    end do
    words = ""
    if (n(1) > 0) words = words//", "//counted(n(1), "curve")//" blanked"
    if (n(2) > 0) words = words//", "//counted(n(2), "curve")//" of other entities"
    if (n(3) > 0) words = words//", "//counted(n(3), "curve")//" that are no geometry"
  end function left_out

  !> Is an entity of one of the types, to be seen, part of no other, and geometry?
  pure logical function is_seen(entry, types)
    type(entry_t), intent(in) :: entry
    integer, intent(in) :: types(:)

    is_seen = any(entry%type == types) .and. .not. (entry%is_blanked .or. entry%is_part) &
              .and. entry%purpose == 0
  end function is_seen

  subroutine read_taken(model, taken, curves)
    type(iges_model_t), intent(inout) :: model
    integer, intent(in) :: taken(:)
    type(nurbs_curve_t), allocatable, intent(out) :: curves(:)
    integer :: i, n_bad

    allocate (curves(size(taken)))
    n_bad = 0
    do i = 1, size(taken)
      model%is_valid = .true.
      call read_curve(model, taken(i), curves(i))
      if (.not. model%is_valid) n_bad = n_bad + 1
      if (n_bad == most_errors) return
    end do
  end subroutine read_taken

  !> Each curve as a line of straight pieces.
  subroutine flatten(curves, plane, factor, lines)
    type(nurbs_curve_t), intent(in) :: curves(:)
    integer, intent(in) :: plane(2)
    real(wp), intent(in) :: factor                !! on all lengths
    type(polygon_t), allocatable, intent(out) :: lines(:)
    type(trim_curve_t), allocatable :: pieces(:)
    real(wp), allocatable :: c(:, :)
    real(wp) :: box(2, 2)
    integer :: i, a

    do a = 1, 2
      box(a, :) = [minval([(minval(curves(i)%points(:, plane(a))), i=1, size(curves))]), &
                   maxval([(maxval(curves(i)%points(:, plane(a))), i=1, size(curves))])]
    end do
    allocate (lines(size(curves)))
    do i = 1, size(curves)
      associate (curve => curves(i), knots => curves(i)%axis%knots)
        allocate (c(3, size(curve%weights)))
        do a = 1, 2
          c(a, :) = factor*curve%points(:, plane(a))*curve%weights
        end do
        c(3, :) = curve%weights
        call spline_curves(curve%axis%degree, knots, c, knots(1), knots(size(knots)), pieces)
        call curve_corners(pieces, near*factor*maxval(box(:, 2) - box(:, 1)), lines(i)%corners)
        deallocate (c)
      end associate
    end do
  end subroutine flatten

  !> Chain the lines to loops; what is open is an error with its gap.
  subroutine close_lines(model, request, taken, lines, loops, origins)
    type(iges_model_t), intent(inout) :: model
    type(iges_request_t), intent(in) :: request
    integer, intent(in) :: taken(:)
    type(polygon_t), intent(in) :: lines(:)
    type(polygon_t), allocatable, intent(out) :: loops(:)
    type(origin_t), allocatable, intent(out) :: origins(:)
    type(chain_fault_t) :: fault
    integer, allocatable :: first(:)
    real(wp) :: extent, tolerance
    integer :: i, a

    extent = maxval([(maxval([(maxval(lines(i)%corners(a, :)), i=1, size(lines))]) &
                      - minval([(minval(lines(i)%corners(a, :)), i=1, size(lines))]), a=1, 2)])
    tolerance = max(model%global%resolution*length_factor(model, request), open*extent)
    call chain_lines(lines, tolerance, loops, fault, first)
    allocate (origins(size(loops)))
    do i = 1, size(loops)
      origins(i) = entry_origin(model, taken(first(i)))
    end do
    if (fault%line == 0) return
    if (fault%is_branch) then
      call reject_entity(model, taken(fault%line), "three curves that meet at "// &
                         place_text([fault%place, 0.0_wp]), "curves that meet in pairs")
      return
    end if
    call reject_entity(model, taken(fault%line), "an end at "//place_text([fault%place, 0.0_wp])// &
                       ", "//rounded_text(fault%gap)//" from the nearest one, of "// &
                       entry_name(model%entries, taken(fault%other)), "curves whose ends meet "// &
                       "within "//rounded_text(tolerance)//", or one that is closed")
  end subroutine close_lines

end module iges_curves
