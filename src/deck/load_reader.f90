!> *PRESSURE, *TRACTION and *GRAVITY.
module load_reader
  use kinds, only: wp
  use input_errors, only: error_list_t, add_error
  use scene, only: scene_t, load_spec_t
  use deck_names, only: deck_names_t
  use deck_steps, only: step_of
  use deck_records, only: record_t, parsed_deck_t, find_records, line_origin, field_word, &
                          field_real, option_text
  use blank_reader, only: box_frame_t
  use boundary_reader, only: n_data_lines, check_lines, end_before
  use motion_reader, only: find_amplitude
  use set_reader, only: find_set
  implicit none
  private

  public :: read_loads

  character(*), parameter :: kinds(3) = [character(8) :: "PRESSURE", "TRACTION", "GRAVITY"]

contains

  !> Fill the list of loads, one for each data line of these keywords.
  subroutine read_loads(deck, frame, names, scene, errors)
    type(parsed_deck_t), intent(in) :: deck
    type(box_frame_t), intent(in) :: frame
    type(deck_names_t), intent(inout) :: names
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
          call find_amplitude(deck, record, names, curve, errors)
          if (.not. record%is_valid) cycle
          call check_lines(deck, record, errors)
          if (option_text(deck, record, "OP") == "NEW") &
            call end_loads(trim(kinds(kind)), step_of(record%step), -1, scene%loads(:n))
          do line = 1, record%n_lines
            n = n + 1
            scene%loads(n)%kind = trim(kinds(kind))
            scene%loads(n)%curve = curve
            scene%loads(n)%first_step = step_of(record%step)
            scene%loads(n)%origin = line_origin(deck, record, line)
            call read_load(deck, record, line, frame, names, scene, n, errors)
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
  subroutine read_load(deck, record, line, frame, names, scene, n, errors)
    type(parsed_deck_t), intent(in) :: deck
    type(record_t), intent(in) :: record
    integer, intent(in) :: line, n
    type(box_frame_t), intent(in) :: frame
    type(deck_names_t), intent(inout) :: names
    type(scene_t), intent(inout) :: scene
    type(error_list_t), intent(inout) :: errors
    integer :: i, set

    if (scene%loads(n)%kind == "GRAVITY") then
      scene%loads(n)%value = [(field_real(record, line, i), i=1, 3)]
      return
    end if
    call find_set(names, frame, field_word(record, line, 1), line_origin(deck, record, line), &
                  scene, set, errors)
    scene%loads(n)%set = set
    if (set > 0) then
      if (.not. is_on_face(scene, set)) then
        call add_error(errors, scene%loads(n)%origin, "the set "//scene%sets(set)%name// &
                       ", which is no face", "a face of the blank or a part of one")
      end if
    end if
    if (scene%loads(n)%kind == "PRESSURE") then
      scene%loads(n)%value(1) = field_real(record, line, 2)
    else
      scene%loads(n)%value = [(field_real(record, line, 1 + i), i=1, 3)]
    end if
  end subroutine read_load

  !> Does the set lie on exactly one face of each patch that it has a part of, by its coordinates
  !! in the patch alone?
  pure logical function is_on_face(scene, set)
    type(scene_t), intent(in) :: scene
    integer, intent(in) :: set
    logical :: is_layer(3)
    integer :: a, p

    is_on_face = .true.
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

end module load_reader
