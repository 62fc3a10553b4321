!> *BOUNDARY, and the loads *PRESSURE, *TRACTION and *GRAVITY.
module boundary_keywords
  use kinds, only: wp
  use input_errors, only: error_list_t, add_error
  use text, only: upper_case, read_integer, to_text
  use scene, only: scene_t, boundary_spec_t, load_spec_t
  use deck_records, only: record_t, parsed_deck_t, find_records, option_text, line_origin, &
                          field_word, field_real, field_integer, is_filled, deck_context_t, &
                          step_of, check_lines, end_before, n_data_lines, field_vector
  use motion_keywords, only: find_amplitude
  use set_keywords, only: find_set
  implicit none
  private

  public :: read_boundaries, read_loads

  character(*), parameter :: kinds(3) = [character(8) :: "PRESSURE", "TRACTION", "GRAVITY"]

contains

  !> Fill the list of boundary conditions, one for each data line of *BOUNDARY.
  subroutine read_boundaries(deck, context, scene, errors)
    type(parsed_deck_t), intent(in) :: deck
    type(deck_context_t), intent(inout) :: context
    type(scene_t), intent(inout) :: scene
    type(error_list_t), intent(inout) :: errors
    integer, allocatable :: found(:)
    integer :: i, line, n, set, curve, step

    allocate (scene%boundaries(n_data_lines(deck, "BOUNDARY")))
    found = find_records(deck, "BOUNDARY")
    n = 0
    do i = 1, size(found)
      associate (record => deck%records(found(i)))
        call find_amplitude(record, context, curve, errors)
        if (.not. record%is_valid) cycle
        step = step_of(record%step)
        call check_lines(record, errors)
        associate (before => scene%boundaries(:n))
          if (option_text(record, "OP") == "NEW") &
            before%last_step = end_before(step, before%first_step, before%last_step)
        end associate
        do line = 1, record%n_lines
          n = n + 1
          scene%boundaries(n)%curve = curve
          scene%boundaries(n)%first_step = step
          scene%boundaries(n)%origin = line_origin(deck, record, line)
          call read_components(record, line, scene%blank%is_shell, scene%boundaries(n), errors)
          if (any(abs(scene%boundaries(n)%velocity) > 0.0_wp)) &
            call check_type(option_text(record, "TYPE"), scene%boundaries(n), errors)
          call find_set(context, field_word(record, line, 1), &
                        line_origin(deck, record, line), scene, set, errors)
          scene%boundaries(n)%set = set
        end do
      end associate
    end do
  end subroutine read_boundaries

  !> Values without TYPE could be displacements, which they are in Abaqus.
  subroutine check_type(type, boundary, errors)
    character(*), intent(in) :: type              !! empty: not given
    type(boundary_spec_t), intent(in) :: boundary
    type(error_list_t), intent(inout) :: errors

    if (type == "DISPLACEMENT") then
      call add_error(errors, boundary%origin, "TYPE=DISPLACEMENT", "TYPE=VELOCITY and the "// &
                     "velocity, whose integral over the step is the displacement")
    else if (type == "") then
      call add_error(errors, boundary%origin, "a value of "// &
                     to_text(boundary%velocity(maxloc(abs(boundary%velocity), 1)))// &
                     " without the option TYPE", "*BOUNDARY, TYPE=VELOCITY: values are velocities")
    end if
  end subroutine check_type

  !> Which components a line prescribes, by number or by one of the names of Abaqus.
  subroutine read_components(record, line, is_shell, boundary, errors)
    type(record_t), intent(in) :: record
    integer, intent(in) :: line
    logical, intent(in) :: is_shell
    type(boundary_spec_t), intent(inout) :: boundary
    type(error_list_t), intent(inout) :: errors
    character(:), allocatable :: word
    integer :: first, last
    logical :: is_number

    word = upper_case(field_word(record, line, 2))
    call read_integer(word, first, is_number)
    if (is_number) then
      last = first
      if (is_filled(record, line, 3)) last = field_integer(record, line, 3)
      if (first >= 1 .and. first <= last .and. any(last == [4, 5, 6])) then
        if (last > first) word = word//", "//to_text(last)
        call refuse_rotations(word, is_shell, boundary, errors)
        return
      end if
      is_number = first >= 1 .and. last <= 3 .and. first <= last
      if (is_number) boundary%is_prescribed(first:last) = .true.
    else
      boundary%word = word
      select case (word)
      case ("XSYMM"); boundary%is_prescribed(1) = .true.
      case ("YSYMM"); boundary%is_prescribed(2) = .true.
      case ("ZSYMM"); boundary%is_prescribed(3) = .true.
      case ("PINNED", "ENCASTRE"); boundary%is_prescribed = .true.
      end select
      if (is_filled(record, line, 3)) boundary%is_prescribed = .false.
    end if
    boundary%velocity = merge(field_real(record, line, 4), 0.0_wp, boundary%is_prescribed)
    if (.not. any(boundary%is_prescribed)) then
      call add_error(errors, boundary%origin, "`"//word//"` for the components", "1, 2 or 3, "// &
                     "first and last, or one of XSYMM, YSYMM, ZSYMM, PINNED, ENCASTRE alone")
    end if
  end subroutine read_components

  !> Components 4 to 6, which nodes of shells have in other programs.
  subroutine refuse_rotations(word, is_shell, boundary, errors)
    character(*), intent(in) :: word               !! the components as given
    logical, intent(in) :: is_shell
    type(boundary_spec_t), intent(in) :: boundary
    type(error_list_t), intent(inout) :: errors

    if (is_shell) then
      call add_error(errors, boundary%origin, "`"//word//"` for the components: 4 to 6 are "// &
                     "rotations, which these shells do not have", "ENCASTRE alone for a "// &
                     "clamped edge; XSYMM, YSYMM or ZSYMM alone for an edge that keeps its "// &
                     "slope in a plane of symmetry; PINNED or components from 1 to 3 for a hinge")
    else
      call add_error(errors, boundary%origin, "`"//word//"` for the components: 4 to 6 are "// &
                     "rotations, which solids do not have", "components from 1 to 3; a face of "// &
                     "which all points are held does not rotate")
    end if
  end subroutine refuse_rotations

  !> Fill the list of loads, one for each data line of these keywords.
  subroutine read_loads(deck, context, scene, errors)
    type(parsed_deck_t), intent(in) :: deck
    type(deck_context_t), intent(inout) :: context
    type(scene_t), intent(inout) :: scene
    type(error_list_t), intent(inout) :: errors
    integer, allocatable :: found(:)
    integer :: kind, i, line, n, curve

    allocate (scene%loads(sum([(n_data_lines(deck, trim(kinds(kind))), kind=1, size(kinds))])))
    n = 0
    do kind = 1, size(kinds)
      found = find_records(deck, trim(kinds(kind)))
      do i = 1, size(found)
        associate (record => deck%records(found(i)))
          call find_amplitude(record, context, curve, errors)
          if (.not. record%is_valid) cycle
          call check_lines(record, errors)
          if (option_text(record, "OP") == "NEW") &
            call end_loads(trim(kinds(kind)), step_of(record%step), -1, scene%loads(:n))
          do line = 1, record%n_lines
            n = n + 1
            scene%loads(n)%kind = trim(kinds(kind))
            scene%loads(n)%curve = curve
            scene%loads(n)%first_step = step_of(record%step)
            scene%loads(n)%origin = line_origin(deck, record, line)
            call read_load(deck, record, line, context, scene, n, errors)
            call end_loads(trim(kinds(kind)), step_of(record%step), scene%loads(n)%set, &
                           scene%loads(:n - 1))
          end do
        end associate
      end do
    end do
  end subroutine read_loads

  !> End loads of a kind that earlier steps gave, on one set or (-1) on all.
  pure subroutine end_loads(kind, step, set, loads)
    character(*), intent(in) :: kind
    integer, intent(in) :: step, set
    type(load_spec_t), intent(inout) :: loads(:)
    integer :: i

    do i = 1, size(loads)
      if (loads(i)%kind /= kind .or. .not. any(set == [-1, loads(i)%set])) cycle
      loads(i)%last_step = end_before(step, loads(i)%first_step, loads(i)%last_step)
    end do
  end subroutine end_loads

  !> Set and value of load `n`.
  subroutine read_load(deck, record, line, context, scene, n, errors)
    type(parsed_deck_t), intent(in) :: deck
    type(record_t), intent(in) :: record
    integer, intent(in) :: line, n
    type(deck_context_t), intent(inout) :: context
    type(scene_t), intent(inout) :: scene
    type(error_list_t), intent(inout) :: errors
    integer :: set

    if (scene%loads(n)%kind == "GRAVITY") then
      scene%loads(n)%value = field_vector(record, line, 1)
      return
    end if
    call find_set(context, field_word(record, line, 1), line_origin(deck, record, line), &
                  scene, set, errors)
    scene%loads(n)%set = set
    if (set > 0) then
      if (.not. is_on_face(scene, set)) then
        call add_error(errors, scene%loads(n)%origin, "the set "//scene%sets(set)%name// &
                       ", which is not on one face", "a face of the blank or a part of one; "// &
                       "a line for each of several")
      end if
    end if
    if (scene%loads(n)%kind == "PRESSURE") then
      scene%loads(n)%value(1) = field_real(record, line, 2)
    else
      scene%loads(n)%value = field_vector(record, line, 2)
    end if
  end subroutine read_load

  !> Does the set lie on exactly one face of each patch that it has a part of, by its coordinates
  !! in the patch alone?
  pure logical function is_on_face(scene, set)
    type(scene_t), intent(in) :: scene
    integer, intent(in) :: set
    logical :: is_layer(3)
    integer :: a, p

    is_on_face = .not. allocated(scene%sets(set)%others)
    do p = 1, size(scene%blank%patches)
      do a = 1, 3
        if (.not. allocated(scene%blank%patches(p)%solid%axes(a)%knots)) return
        associate (knots => scene%blank%patches(p)%solid%axes(a)%knots, spec => scene%sets(set))
          is_layer(a) = spec%upper(a, p) <= knots(1) .or. spec%lower(a, p) >= knots(size(knots))
        end associate
      end do
      if (any(scene%sets(set)%lower(:, p) > scene%sets(set)%upper(:, p))) cycle
      is_on_face = is_on_face .and. count(is_layer) == 1
    end do
    is_on_face = is_on_face .and. all(scene%sets(set)%from <= -huge(1.0_wp)) &
                 .and. all(scene%sets(set)%to >= huge(1.0_wp))
  end function is_on_face

end module boundary_keywords
