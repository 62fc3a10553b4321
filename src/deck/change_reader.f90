!> *MODEL CHANGE: tools and draw beads that come or go with a step.
module change_reader
  use input_errors, only: origin_t, error_list_t, add_error
  use text, only: upper_case, squeezed
  use name_table, only: name_table_t, insert
  use scene, only: scene_t, contact_spec_t, bead_spec_t, motion_spec_t
  use deck_names, only: deck_names_t, resolve
  use deck_steps, only: step_of
  use deck_records, only: parsed_deck_t, find_records, is_option_given, field_word, line_origin, &
                          n_fields
  implicit none
  private

  public :: read_changes

contains

  !> Cut contact pairs and draw beads where *MODEL CHANGE takes them away, or brings them again.
  subroutine read_changes(deck, names, scene, errors)
    type(parsed_deck_t), intent(in) :: deck
    type(deck_names_t), intent(in) :: names
    type(scene_t), intent(inout) :: scene
    type(error_list_t), intent(inout) :: errors
    type(name_table_t) :: known
    type(origin_t) :: origin
    type(motion_spec_t) :: parked(size(scene%tools))
    integer, allocatable :: found(:)
    integer :: i, line, j, place, n_tools
    logical :: is_added

    known = names%tools
    n_tools = known%n_names
    call enter_beads(scene%beads, known)
    found = find_records(deck, "MODEL CHANGE")
    do i = 1, size(found)
      associate (record => deck%records(found(i)))
        if (.not. record%is_valid) cycle
        is_added = is_option_given(deck, record, "ADD")
        if (is_added .eqv. is_option_given(deck, record, "REMOVE")) then
          call add_error(errors, record%origin, "not one of ADD and REMOVE", "ADD or REMOVE")
          cycle
        end if
        do line = 1, record%n_lines
          origin = line_origin(deck, record, line)
          do j = 1, n_fields(record, line)
            if (field_word(record, line, j) == "") cycle
            call resolve(known, field_word(record, line, j), "*TOOL or *DRAW BEAD", origin, &
                         place, errors)
            if (place > n_tools) then
              call change_bead(known%names(place)%value, step_of(record%step), is_added, origin, &
                               scene%beads, errors)
            else if (place > 0) then
              call change_tool(place, step_of(record%step), is_added, origin, scene, errors)
              call park_tool(place, step_of(record%step), is_added, origin, parked(place), &
                             scene%motions)
            end if
          end do
        end do
      end associate
    end do
  end subroutine read_changes

  !> Names of beads behind those of tools; several beads may share one.
  subroutine enter_beads(beads, known)
    type(bead_spec_t), intent(in) :: beads(:)
    type(name_table_t), intent(inout) :: known
    logical :: is_new
    integer :: i

    do i = 1, size(beads)
      call insert(known, squeezed(upper_case(beads(i)%name)), is_new)
    end do
  end subroutine enter_beads

  !> One tool comes or goes with a step.
  subroutine change_tool(tool, step, is_added, origin, scene, errors)
    integer, intent(in) :: tool, step
    logical, intent(in) :: is_added
    type(origin_t), intent(in) :: origin
    type(scene_t), intent(inout) :: scene
    type(error_list_t), intent(inout) :: errors
    type(contact_spec_t), allocatable :: again(:)
    logical :: is_there(size(scene%contacts))
    integer :: last(size(scene%contacts))

    associate (contacts => scene%contacts)
      is_there = contacts%tool == tool .and. contacts%last_step >= step
      if (any(is_there) .eqv. is_added .or. .not. any(contacts%tool == tool)) then
        call add_error(errors, origin, "the tool "//scene%tools(tool)%name//", which is "// &
                       place_now(is_added)//" already or has no *CONTACT PAIR", "another tool")
      else if (is_added) then
        last = contacts%last_step
        again = pack(contacts, contacts%tool == tool .and. &
                     last == maxval(last, mask=contacts%tool == tool))
        again%first_step = step
        again%last_step = huge(1)
      else
        where (is_there) contacts%last_step = step - 1
      end if
    end associate
    if (allocated(again)) scene%contacts = [scene%contacts, again]
  end subroutine change_tool

  !> A tool that a force moves would fly off while it is away: it stands still until it comes again,
  !! or until the deck gives it another motion.
  subroutine park_tool(tool, step, is_added, origin, parked, motions)
    integer, intent(in) :: tool, step
    logical, intent(in) :: is_added
    type(origin_t), intent(in) :: origin
    type(motion_spec_t), intent(inout) :: parked   !! the force that waits; of tool 0: none
    type(motion_spec_t), allocatable, intent(inout) :: motions(:)
    type(motion_spec_t) :: new
    integer :: i, last

    last = 0
    do i = 1, size(motions)
      if (motions(i)%tool /= tool .or. motions(i)%step > step) cycle
      if (last == 0) last = i
      if (motions(i)%step >= motions(last)%step) last = i
    end do
    if (last == 0) return
    if (is_added) then
      if (parked%tool == 0 .or. motions(last)%step == step) return
      new = parked
      new%step = step
      parked%tool = 0
      call append_motion(new, motions)
    else if (motions(last)%is_force) then
      parked = motions(last)
      new%origin = origin
      new%tool = tool
      new%step = step
      if (motions(last)%step == step) motions(last) = new
      if (motions(last)%is_force) call append_motion(new, motions)
    end if
  end subroutine park_tool

  subroutine append_motion(new, motions)
    type(motion_spec_t), intent(in) :: new
    type(motion_spec_t), allocatable, intent(inout) :: motions(:)
    type(motion_spec_t), allocatable :: longer(:)
    integer :: i

    allocate (longer(size(motions) + 1))
    do i = 1, size(motions)
      longer(i) = motions(i)
    end do
    longer(size(longer)) = new
    call move_alloc(longer, motions)
  end subroutine append_motion

  !> The beads of a name come or go with a step.
  subroutine change_bead(name, step, is_added, origin, beads, errors)
    character(*), intent(in) :: name       !! in capitals
    integer, intent(in) :: step
    logical, intent(in) :: is_added
    type(origin_t), intent(in) :: origin
    type(bead_spec_t), allocatable, intent(inout) :: beads(:)
    type(error_list_t), intent(inout) :: errors
    logical :: is_meant(size(beads)), is_there(size(beads))
    integer :: i, n

    is_meant = [(squeezed(upper_case(beads(i)%name)) == name, i=1, size(beads))]
    is_there = is_meant .and. beads%last_step >= step
    if (any(is_there) .eqv. is_added) then
      call add_error(errors, origin, "the draw bead "//beads(findloc(is_meant, .true., 1))%name// &
                     ", which is "//place_now(is_added)//" already", "another bead")
    else if (is_added) then
      n = maxval(beads%last_step, mask=is_meant)
      is_meant = is_meant .and. beads%last_step == n
      call bring_again(pack([(i, i=1, size(beads))], is_meant), step, beads)
    else
      where (is_there) beads%last_step = step - 1
    end if
  end subroutine change_bead

  !> Append beads that begin once more; their curves go on from the step that named them first.
  subroutine bring_again(which, step, beads)
    integer, intent(in) :: which(:), step
    type(bead_spec_t), allocatable, intent(inout) :: beads(:)
    type(bead_spec_t), allocatable :: longer(:)
    integer :: i, n

    n = size(beads)
    allocate (longer(n + size(which)))
    do i = 1, size(longer)
      if (i <= n) longer(i) = beads(i)
      if (i <= n) cycle
      longer(i) = beads(which(i - n))
      longer(i)%first_step = step
      longer(i)%last_step = huge(1)
    end do
    call move_alloc(longer, beads)
  end subroutine bring_again

  pure function place_now(is_added) result(words)
    logical, intent(in) :: is_added
    character(:), allocatable :: words

    words = trim(merge("there", "away ", is_added))
  end function place_now

end module change_reader
