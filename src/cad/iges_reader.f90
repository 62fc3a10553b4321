!> Surfaces of a tool from an IGES file (version 5.3, fixed columns), with a report.
!!
!! Read are rational B-spline surfaces (128), also trimmed ones (144), surfaces of revolution (120)
!! and tabulated cylinders (122) with their curves and transformations, in the unit of the deck.
!! Surfaces that meet at their edges are reversed where needed, so that their normals agree.
module iges_reader
  use kinds, only: wp
  use input_errors, only: error_list_t, new_origin, add_error, add_warning, n_errors
  use text, only: string_t, to_text, rounded_text, place_text, append_text, joined, counted
  use nurbs_surface, only: nurbs_surface_t
  use face_extent, only: face_area, face_box
  use surface_seams, only: surface_seams_t, find_surface_seams, orient_surfaces
  use iges_directory, only: entry_title
  use iges_model, only: iges_model_t, read_iges_model
  use iges_selection, only: iges_request_t, select_entries, bounded_lines, skipped_lines, &
                            length_factor
  use iges_trims, only: read_trimmed
  implicit none
  private

  public :: read_iges

  integer, parameter :: most_errors = 20   !! of surfaces that are reported

contains

  !> Read the surfaces that a deck asks for. With an error among the errors there are none; a report
  !! there is then for a list alone, of what cannot be read.
  subroutine read_iges(request, surfaces, report, errors)
    type(iges_request_t), intent(in) :: request
    type(nurbs_surface_t), allocatable, intent(out) :: surfaces(:)   !! in the unit of the deck
    type(string_t), allocatable, intent(out) :: report(:)            !! lines for the log
    type(error_list_t), intent(inout) :: errors
    type(iges_model_t) :: model
    type(surface_seams_t) :: seams
    type(string_t), allocatable :: faults(:)
    integer, allocatable :: reason(:), taken(:)
    integer :: n_before, i

    n_before = n_errors(errors)
    allocate (surfaces(0), faults(0))
    model%file%errors = errors
    call read_iges_model(request%path, model)
    if (n_errors(model%file%errors) == n_before) call select_entries(model, request, reason)
    if (n_errors(model%file%errors) == n_before) &
      call read_taken(model, request, reason, taken, surfaces, faults)
    errors = model%file%errors
    if (n_errors(errors) > n_before) then
      report = faults
      deallocate (surfaces)
      allocate (surfaces(0))
      return
    end if
    do i = 1, size(surfaces)
      surfaces(i)%points = length_factor(model, request)*surfaces(i)%points
    end do
    call find_surface_seams(surfaces, seam_tolerance(model, request, surfaces), seams)
    ! Solids that touch, and faces that meet in threes: what the file says of their sides counts.
    if (seams%is_one_sided) seams%is_reversed = .false.
    call orient_surfaces(seams, surfaces)
    if (maxval(seams%group) > 1) then
      call add_warning(errors, request%origin, "surfaces of `"//request%path//"` in "// &
                       to_text(maxval(seams%group))//" groups that do not meet, so that "// &
                       "their sides cannot be compared", "one connected tool, or normals "// &
                       "that point to the same side in all groups")
    end if
    if (seams%is_one_sided) then
      call add_warning(errors, request%origin, "surfaces of `"//request%path//"` whose "// &
                       "sides cannot be made to agree and stay as they are in it", &
                       "surfaces that meet in pairs and have two sides")
    end if
    call write_report(model, request, surfaces, taken, reason, seams, faults, report)
  end subroutine read_iges

  !> Read what was selected. What cannot be read is an error, in a list a line of its own; so is a
  !! file of which nothing is left.
  subroutine read_taken(model, request, reason, taken, surfaces, faults)
    type(iges_model_t), intent(inout) :: model
    type(iges_request_t), intent(in) :: request
    integer, intent(in) :: reason(:)
    integer, allocatable, intent(out) :: taken(:)       !! positions in the list of entries
    type(nurbs_surface_t), allocatable, intent(inout) :: surfaces(:)
    type(string_t), allocatable, intent(inout) :: faults(:)
    type(error_list_t) :: before
    type(string_t), allocatable :: skipped(:), bounded(:)
    character(:), allocatable :: found
    integer :: i, n, n_bad

    taken = pack([(i, i=1, size(reason))], reason == 0)
    deallocate (surfaces)
    allocate (surfaces(size(taken)))
    n = 0
    n_bad = 0
    do i = 1, size(taken)
      if (request%is_listing) before = model%file%errors
      call read_trimmed(model, taken(i), surfaces(n + 1))
      if (model%is_valid) then
        n = n + 1
        taken(n) = taken(i)
      else if (request%is_listing) then
        call append_text(faults, fault_line(model, taken(i)))
        model%file%errors = before
      else
        n_bad = n_bad + 1
        if (n_bad == most_errors) return
      end if
    end do
    if (n_bad > 0) return
    taken = taken(:n)
    surfaces = surfaces(:n)
    if (request%is_listing) then
      bounded = bounded_lines(model, reason)
      call append_all(bounded, faults)
    end if
    if (n > 0) return
    skipped = skipped_lines(model, reason)
    found = "no surface for a tool"
    if (size(skipped) > 0) found = found//", "//joined(skipped, ", ")
    call add_error(model%file%errors, new_origin(request%path, 0, "IGES"), found, &
                   "surfaces of type 144, 128, 120 or 122 that stand for themselves")
  end subroutine read_taken

  !> Why a surface cannot be read, by the last of the errors.
  function fault_line(model, entry) result(line)
    type(iges_model_t), intent(in) :: model
    integer, intent(in) :: entry
    character(:), allocatable :: line

    associate (last => model%file%errors%items(model%file%errors%n_items))
      line = entry_title(model%entries, entry)//", not read: "//last%found//" ("// &
             last%origin%keyword//", line "//to_text(last%origin%line)//")"
    end associate
  end function fault_line

  !> How far edges that meet may be apart: what the file itself counts as nothing, but at least a
  !! millionth and at most a thousandth of the tool.
  pure real(wp) function seam_tolerance(model, request, surfaces) result(tolerance)
    type(iges_model_t), intent(in) :: model
    type(iges_request_t), intent(in) :: request
    type(nurbs_surface_t), intent(in) :: surfaces(:)
    real(wp), parameter :: least = 1.0e-6_wp, largest = 1.0e-3_wp
    real(wp) :: box(3, 2)

    box = box_of(surfaces)
    tolerance = model%global%resolution*length_factor(model, request)
    tolerance = min(max(tolerance, least*norm2(box(:, 2) - box(:, 1))), &
                    largest*norm2(box(:, 2) - box(:, 1)))
  end function seam_tolerance

  !> Lines on the file, each surface that was taken, those that cannot be, what was left out and the
  !! joints.
  subroutine write_report(model, request, surfaces, taken, reason, seams, faults, report)
    type(iges_model_t), intent(in) :: model
    type(iges_request_t), intent(in) :: request
    type(nurbs_surface_t), intent(in) :: surfaces(:)
    integer, intent(in) :: taken(:), reason(:)
    type(surface_seams_t), intent(in) :: seams
    type(string_t), intent(in) :: faults(:)
    type(string_t), allocatable, intent(out) :: report(:)
    type(string_t), allocatable :: lines(:)
    character(:), allocatable :: line
    real(wp) :: box(3, 2), all_boxes(3, 2)
    integer :: i

    allocate (report(0), lines(0))
    call append_text(report, request%path//", lengths in "//model%global%unit//" times "// &
             to_text(length_factor(model, request))//": "//counted(size(taken), &
             "surface")//" of "//counted(size(reason), "entity", "entities"))
    all_boxes(:, 1) = huge(1.0_wp)
    all_boxes(:, 2) = -huge(1.0_wp)
    do i = 1, size(taken)
      line = entry_title(model%entries, taken(i))
      if (request%with_extents) then
        box = face_box(surfaces(i))
        all_boxes(:, 1) = min(all_boxes(:, 1), box(:, 1))
        all_boxes(:, 2) = max(all_boxes(:, 2), box(:, 2))
        line = line//", area "//rounded_text(face_area(surfaces(i)))//", "//box_text(box)
      end if
      call append_text(lines, line//", "//surface_words(surfaces(i), seams%is_reversed(i)))
    end do
    if (request%with_extents) call append_text(report, box_text(all_boxes))
    call append_all(lines, report)
    call append_all(faults, report)
    lines = skipped_lines(model, reason)
    call append_all(lines, report)
    call append_text(report, seam_line(seams))
  end subroutine write_report

  !> Not by an array constructor, which never frees the texts of a function's result.
  subroutine append_all(lines, report)
    type(string_t), intent(in) :: lines(:)
    type(string_t), allocatable, intent(inout) :: report(:)
    integer :: i

    do i = 1, size(lines)
      call append_text(report, lines(i)%value)
    end do
  end subroutine append_all

  !> Such as `box (0, 0, 0) to (1, 2, 3)`.
  function box_text(box) result(words)
    real(wp), intent(in) :: box(3, 2)
    character(:), allocatable :: words

    words = "box "//place_text(box(:, 1))//" to "//place_text(box(:, 2))
  end function box_text

  function surface_words(surface, is_reversed) result(words)
    type(nurbs_surface_t), intent(in) :: surface
    logical, intent(in) :: is_reversed
    character(:), allocatable :: words

    words = "degrees "//to_text(surface%axes(1)%degree)//" x "//to_text(surface%axes(2)%degree)// &
            ", "//to_text(surface%axes(1)%n_basis)//" x "//to_text(surface%axes(2)%n_basis)// &
            " control points"
    if (allocated(surface%loops)) words = words//", "//counted(size(surface%loops), "loop")
    if (is_reversed) words = words//", turned: its normal disagreed across an edge"
  end function surface_words

  function seam_line(seams) result(line)
    type(surface_seams_t), intent(in) :: seams
    character(:), allocatable :: line
    integer :: n_whole

    associate (list => seams%seams)
      n_whole = count(list%is_whole)
      line = "joints: "//counted(n_whole, "pair of edges meets", "pairs of edges meet")
      if (size(list) > n_whole) line = line//", "//counted(size(list) - n_whole, &
                                       "edge meets", "edges meet")//" a part of another"
      if (size(list) > 0) line = line//", largest gap "//rounded_text(maxval(list%gap))
    end associate
    line = line//"; "//counted(seams%n_free, "free edge")//"; "// &
           counted(count(seams%is_reversed), "surface")//" turned"
  end function seam_line

  !> Around the control points of all surfaces.
  pure function box_of(surfaces) result(box)
    type(nurbs_surface_t), intent(in) :: surfaces(:)
    real(wp) :: box(3, 2)
    integer :: i, c

    box(:, 1) = huge(1.0_wp)
    box(:, 2) = -huge(1.0_wp)
    do i = 1, size(surfaces)
      do c = 1, 3
        box(c, 1) = min(box(c, 1), minval(surfaces(i)%points(:, :, c)))
        box(c, 2) = max(box(c, 2), maxval(surfaces(i)%points(:, :, c)))
      end do
    end do
  end function box_of

end module iges_reader
