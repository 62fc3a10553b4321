!> Blanks of several patches: round shapes of *BLANK, and the seams between patches.
module shape_reader
  use kinds, only: wp
  use failure, only: error_t
  use input_errors, only: error_list_t, add_error, add_warning
  use text, only: to_text, rounded_text
  use nurbs_solid, only: nurbs_solid_t
  use round_solids, only: round_shape_t, disk_solids, bar_solids, ring_solids, tube_solids, &
                          cup_solids
  use seams, only: seams_t, find_seams, group_table
  use patch_joints, only: joints_t, find_joints, face_names, find_tee_joints
  use scene, only: blank_spec_t
  use deck_records, only: record_t, parsed_deck_t, option_text, option_real, field_real, &
                          field_integer
  implicit none
  private

  public :: read_round, join_patches

contains

  !> Patches of a blank of TYPE=DISK, BAR, RING, TUBE or CUP.
  subroutine read_round(deck, record, blank, is_complete, errors)
    type(parsed_deck_t), intent(in) :: deck
    type(record_t), intent(in) :: record
    type(blank_spec_t), intent(inout) :: blank
    logical, intent(out) :: is_complete
    type(error_list_t), intent(inout) :: errors
    type(nurbs_solid_t), allocatable :: solids(:)
    type(error_t), allocatable :: error
    integer :: p

    is_complete = .false.
    if (.not. record%is_valid) return
    select case (option_text(deck, record, "TYPE"))
    case ("DISK"); call disk_solids(round_shape(deck, record, .false.), solids, error)
    case ("BAR"); call bar_solids(round_shape(deck, record, .false.), solids, error)
    case ("CUP"); call cup_solids(round_shape(deck, record, .true.), solids, error)
    case ("RING"); call ring_solids(ring_shape(deck, record), solids, error)
    case default; call tube_solids(ring_shape(deck, record), solids, error)
    end select
    if (allocated(error)) then
      call add_error(errors, record%origin, "a round blank that cannot be made ("// &
                     error%message//")", "radii, angle and degrees that fit together")
      return
    end if
    is_complete = .true.
    deallocate (blank%patches)
    allocate (blank%patches(size(solids)))
    do p = 1, size(solids)
      blank%patches(p)%solid = solids(p)
      blank%patches(p)%name = blank%name
      if (size(solids) == 1) cycle
      blank%patches(p)%name = part_name(p, size(solids), option_text(deck, record, "TYPE") == "CUP")
    end do
  end subroutine read_round

  !> Names of the patches of a round section, and of the rest of a cup.
  function part_name(p, n, is_cup) result(name)
    integer, intent(in) :: p, n        !! patch, and how many there are
    logical, intent(in) :: is_cup
    character(:), allocatable :: name
    character(6), parameter :: rings(3) = [character(6) :: "RIM", "CORNER", "WALL"]
    integer :: n_around

    n_around = n - 1
    if (is_cup) n_around = (n - 1)/3
    name = "CORE"
    if (p > 1) name = trim(rings((p - 2)/n_around + 1))//to_text(mod(p - 2, n_around) + 1)
  end function part_name

  !> Data lines of disks and bars, or of cups, which have two numbers more on either line.
  function round_shape(deck, record, is_cup) result(shape)
    type(parsed_deck_t), intent(in) :: deck
    type(record_t), intent(in) :: record
    logical, intent(in) :: is_cup
    type(round_shape_t) :: shape
    integer :: i, more

    more = merge(2, 0, is_cup)
    shape%axis = index("XYZ", option_text(deck, record, "AXIS"))
    shape%origin = [(field_real(record, 1, i), i=1, 3)]
    shape%radius = field_real(record, 1, 4)
    shape%height = field_real(record, 1, 5)
    shape%angle = field_real(record, 2, 1)
    shape%degrees = [field_integer(record, 2, 2), field_integer(record, 2, 5 + more)]
    shape%n_elements = [field_integer(record, 2, 3), field_integer(record, 2, 4), &
                        field_integer(record, 2, 6 + more)]
    shape%core = field_real(record, 2, 7 + more)
    if (.not. is_cup) return
    shape%thickness = field_real(record, 1, 6)
    shape%corner = field_real(record, 1, 7)
    shape%n_along = [field_integer(record, 2, 5), field_integer(record, 2, 6)]
  end function round_shape

  !> Data lines of rings and tubes.
  function ring_shape(deck, record) result(shape)
    type(parsed_deck_t), intent(in) :: deck
    type(record_t), intent(in) :: record
    type(round_shape_t) :: shape
    integer :: i

    shape%axis = index("XYZ", option_text(deck, record, "AXIS"))
    shape%origin = [(field_real(record, 1, i), i=1, 3)]
    shape%inner_radius = field_real(record, 1, 4)
    shape%radius = field_real(record, 1, 5)
    shape%height = field_real(record, 1, 6)
    shape%start = field_real(record, 2, 1)
    shape%angle = field_real(record, 2, 2)
    shape%degrees = [field_integer(record, 2, 3), field_integer(record, 2, 6)]
    shape%n_elements = [field_integer(record, 2, 4), field_integer(record, 2, 5), &
                        field_integer(record, 2, 7)]
  end function ring_shape

  !> Find the seams of a blank as its MERGE option asks. Faces that meet but do not fit are errors;
  !! a blank that falls apart is one that the user should know of.
  subroutine join_patches(deck, record, blank, errors)
    type(parsed_deck_t), intent(in) :: deck
    type(record_t), intent(in) :: record
    type(blank_spec_t), intent(inout) :: blank
    type(error_list_t), intent(inout) :: errors
    type(nurbs_solid_t) :: solids(size(blank%patches))
    type(seams_t) :: seams
    type(joints_t) :: joints
    real(wp) :: tolerance
    logical :: is_whole
    integer :: p, i

    if (option_text(deck, record, "MERGE") == "NO") return
    do p = 1, size(solids)
      solids(p) = blank%patches(p)%solid
    end do
    tolerance = option_real(deck, record, "TOLERANCE")
    if (tolerance <= 0.0_wp) tolerance = default_tolerance(solids)
    blank%merge_distance = tolerance
    call find_seams(solids, tolerance, seams)
    call check_neighbours(record, blank, seams, tolerance, is_whole, errors)
    if (.not. is_whole) return
    joints = find_joints(solids, seams)
    do p = 1, size(solids)
      blank%patches(p)%solid = solids(p)
      blank%patches(p)%is_joined = joints%is_joined(:, p)
    end do
    do i = 1, size(joints%reasons)
      call add_error(errors, record%origin, "patches '"// &
                     blank%patches(joints%misfit(1, i))%name//"' and '"// &
                     blank%patches(joints%misfit(3, i))%name//"' that do not fit, "// &
                     joints%reasons(i)%value, "the same degrees, knots, weights and control "// &
                     "points on both faces, or MERGE=NO")
    end do
    if (size(joints%reasons) > 0) return
    call warn_of_tee_joints(record, blank, find_tee_joints(solids, joints%is_joined, tolerance), &
                            errors)
    call check_whole(record, blank, joints, errors)
  end subroutine join_patches

  !> Refuse a tolerance that makes neighbours in the grid of a patch one point, unless they were one
  !! before but for round-off: the blank would lose volume.
  subroutine check_neighbours(record, blank, seams, tolerance, is_whole, errors)
    type(record_t), intent(in) :: record
    type(blank_spec_t), intent(in) :: blank     !! as it was before the seams were found
    type(seams_t), intent(in) :: seams
    real(wp), intent(in) :: tolerance
    logical, intent(out) :: is_whole            !! no neighbours were lost
    type(error_list_t), intent(inout) :: errors
    real(wp) :: apart
    integer :: p

    is_whole = .true.
    do p = 1, size(blank%patches)
      associate (solid => blank%patches(p)%solid)
        apart = widest_loss(solid, reshape(group_table(seams, p, size(solid%weights)), &
                                           shape(solid%weights)))
        if (apart <= default_tolerance([solid])) cycle
        is_whole = .false.
        call add_error(errors, record%origin, "TOLERANCE="//to_text(tolerance)//", which makes "// &
                       "neighbouring control points of the patch '"//blank%patches(p)%name// &
                       "' one that are "//rounded_text(apart)//" apart", "less than that")
      end associate
    end do
  end subroutine check_neighbours

  !> Largest distance of neighbours in a grid that are of one group.
  pure real(wp) function widest_loss(solid, group) result(distance)
    type(nurbs_solid_t), intent(in) :: solid
    integer, intent(in) :: group(:, :, :)       !! 0: none
    integer :: i, j, k, axis, at(3)

    distance = 0.0_wp
    do axis = 1, 3
      do k = 1, size(group, 3)
        do j = 1, size(group, 2)
          do i = 1, size(group, 1)
            at = [i, j, k]
            at(axis) = at(axis) + 1
            if (at(axis) > size(group, axis) .or. group(i, j, k) == 0) cycle
            if (group(at(1), at(2), at(3)) /= group(i, j, k)) cycle
            distance = max(distance, norm2(solid%points(at(1), at(2), at(3), :) &
                                           - solid%points(i, j, k, :)))
          end do
        end do
      end do
    end do
  end function widest_loss

  !> Warn of faces that lie on each other without being joined.
  subroutine warn_of_tee_joints(record, blank, pairs, errors)
    type(record_t), intent(in) :: record
    type(blank_spec_t), intent(in) :: blank
    integer, intent(in) :: pairs(:, :)        !! see `find_tee_joints`
    type(error_list_t), intent(inout) :: errors
    integer :: i

    do i = 1, size(pairs, 2)
      call add_warning(errors, record%origin, "the faces "//trim(face_names(pairs(2, i)))// &
                       " of '"//blank%patches(pairs(1, i))%name//"' and "// &
                       trim(face_names(pairs(4, i)))//" of '"//blank%patches(pairs(3, i))%name// &
                       "', which lie on each other in part, so that nothing joins them there", &
                       "patches cut so that whole faces meet")
    end do
  end subroutine warn_of_tee_joints

  !> Warn of patches that no common faces lead to.
  subroutine check_whole(record, blank, joints, errors)
    type(record_t), intent(in) :: record
    type(blank_spec_t), intent(in) :: blank
    type(joints_t), intent(in) :: joints
    type(error_list_t), intent(inout) :: errors
    logical :: is_reached(size(blank%patches))
    integer :: i, p

    is_reached = .false.
    is_reached(1) = .true.
    do i = 1, size(is_reached)
      do p = 1, size(is_reached)
        is_reached(p) = is_reached(p) .or. any(is_reached .and. joints%is_tied(:, p))
      end do
    end do
    do p = 1, size(is_reached)
      if (is_reached(p)) cycle
      call add_warning(errors, record%origin, "the patch '"//blank%patches(p)%name// &
                       "', which has no face in common with the others", &
                       "control points of its face on those of another patch")
    end do
  end subroutine check_whole

  !> A millionth of the blank's size: below any element, above the round-off of listed points.
  pure real(wp) function default_tolerance(solids) result(tolerance)
    type(nurbs_solid_t), intent(in) :: solids(:)
    real(wp), parameter :: share = 1.0e-6_wp
    real(wp) :: low(3), high(3)
    integer :: p, c

    low = huge(1.0_wp)
    high = -huge(1.0_wp)
    do p = 1, size(solids)
      do c = 1, 3
        low(c) = min(low(c), minval(solids(p)%points(:, :, :, c)))
        high(c) = max(high(c), maxval(solids(p)%points(:, :, :, c)))
      end do
    end do
    tolerance = share*norm2(high - low)
  end function default_tolerance

end module shape_reader
