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
  use iges_directory, only: type_name
  use iges_model, only: iges_model_t, read_iges_model
  use iges_selection, only: iges_request_t, select_entries, skipped_lines, length_factor
  use iges_trims, only: read_trimmed
  implicit none
  private

  public :: read_iges

  integer, parameter :: most_errors = 20   !! of surfaces that are reported

contains

  !> Read the surfaces that a deck asks for. With an error among the errors there are none.
  subroutine read_iges(request, surfaces, report, errors)
    type(iges_request_t), intent(in) :: request
    type(nurbs_surface_t), allocatable, intent(out) :: surfaces(:)   !! in the unit of the deck
    type(string_t), allocatable, intent(out) :: report(:)            !! lines for the log
    type(error_list_t), intent(inout) :: errors
    type(iges_model_t) :: model
    type(surface_seams_t) :: seams
    type(string_t), allocatable :: skipped(:)
    character(:), allocatable :: found
    integer, allocatable :: reason(:), taken(:)
    integer :: n_before, i

    n_before = n_errors(errors)
    allocate (surfaces(0), report(0))
    model%file%errors = errors
    call read_iges_model(request%path, model)
    if (n_errors(model%file%errors) == n_before) call select_entries(model, request, reason)
    if (n_errors(model%file%errors) == n_before) then
      taken = pack([(i, i=1, size(reason))], reason == 0)
      if (size(taken) > 0) call read_taken(model, taken, surfaces)
    end if
    errors = model%file%errors
    if (n_errors(errors) > n_before) then
      deallocate (surfaces)
      allocate (surfaces(0))
    else if (size(taken) == 0) then
      skipped = skipped_lines(model, reason)
      found = "no surface for a tool"
      if (size(skipped) > 0) found = found//", "//joined(skipped, ", ")
      call add_error(errors, new_origin(request%path, 0, "IGES"), found, &
                     "surfaces of type 144, 128, 120 or 122 that stand for themselves")
    else
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
      call write_report(model, request, surfaces, taken, reason, seams, report)
    end if
  end subroutine read_iges

  subroutine read_taken(model, taken, surfaces)
    type(iges_model_t), intent(inout) :: model
    integer, intent(in) :: taken(:)
    type(nurbs_surface_t), allocatable, intent(inout) :: surfaces(:)
    integer :: i, n_bad

    deallocate (surfaces)
    allocate (surfaces(size(taken)))
    n_bad = 0
    do i = 1, size(taken)
      call read_trimmed(model, taken(i), surfaces(i))
      if (.not. model%is_valid) n_bad = n_bad + 1
      if (n_bad == most_errors) return
    end do
  end subroutine read_taken

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

  !> Lines on the file, each surface that was taken, what was left out and the joints.
  subroutine write_report(model, request, surfaces, taken, reason, seams, report)
    type(iges_model_t), intent(in) :: model
    type(iges_request_t), intent(in) :: request
    type(nurbs_surface_t), intent(in) :: surfaces(:)
    integer, intent(in) :: taken(:), reason(:)
    type(surface_seams_t), intent(in) :: seams
    type(string_t), allocatable, intent(inout) :: report(:)
    type(string_t), allocatable :: skipped(:)
    real(wp), allocatable :: boxes(:, :, :)
    integer :: i

    allocate (boxes(3, 2, size(surfaces)))
    do i = 1, size(surfaces)
      boxes(:, :, i) = face_box(surfaces(i))
    end do
    call append_text(report, request%path//", lengths in "//model%global%unit//" times "// &
             to_text(length_factor(model, request))//": "//counted(size(taken), &
             "surface")//" of "//counted(size(reason), "entity", "entities"))
    call append_text(report, box_text(minval(boxes(:, 1, :), 2), maxval(boxes(:, 2, :), 2)))
    do i = 1, size(taken)
      call append_text(report, surface_line(model, taken(i), surfaces(i), boxes(:, :, i), &
                                            seams%is_reversed(i)))
    end do
    skipped = skipped_lines(model, reason)
    do i = 1, size(skipped)
      call append_text(report, skipped(i)%value)
    end do
    call append_text(report, seam_line(seams))
  end subroutine write_report

  !> Such as `box (0, 0, 0) to (1, 2, 3)`.
  function box_text(low, high) result(words)
    real(wp), intent(in) :: low(3), high(3)
    character(:), allocatable :: words

    words = "box "//place_text(low)//" to "//place_text(high)
  end function box_text

  function surface_line(model, entry, surface, box, is_reversed) result(line)
    type(iges_model_t), intent(in) :: model
    integer, intent(in) :: entry
    type(nurbs_surface_t), intent(in) :: surface
    real(wp), intent(in) :: box(3, 2)
    logical, intent(in) :: is_reversed
    character(:), allocatable :: line

    line = "D"//to_text(2*entry - 1)//" "//type_name(model%entries(entry)%type)
    if (model%entries(entry)%label /= "") line = line//" "//model%entries(entry)%label
    line = line//", area "//rounded_text(face_area(surface))//", "//box_text(box(:, 1), &
           box(:, 2))//", degrees "//to_text(surface%axes(1)%degree)//" x "// &
           to_text(surface%axes(2)%degree)//", "//to_text(surface%axes(1)%n_basis)//" x "// &
           to_text(surface%axes(2)%n_basis)//" control points"
    if (allocated(surface%loops)) line = line//", "//counted(size(surface%loops), "loop")
    if (is_reversed) line = line//", turned: its normal disagreed across an edge"
  end function surface_line

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
