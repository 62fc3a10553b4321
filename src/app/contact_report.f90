!> What the log reports of contact at the end of a run.
module contact_report
  use kinds, only: wp
  use text, only: to_text, rounded_text, place_text, counted
  use run_log, only: run_log_t, log_line
  use contact_effect, only: contact_effect_t, contact_view_t, contact_pairs
  use start_gaps, only: face_gaps
  use tool, only: tool_t
  use model, only: model_t
  use run_state, only: run_t
  implicit none
  private

  public :: log_contact

  !> How a tool and a face of the blank have met.
  type :: meeting_t
    integer :: tool = 0, face = 0            !! numbers in the model and of the patch
    logical :: has_touched = .false.         !! at a contact point
    real(wp) :: depth = 0.0_wp               !! greatest between contact points [length]
    real(wp) :: nearest = huge(1.0_wp)       !! of a contact point in the end [length]
    logical :: is_behind = .false.           !! there it is on the other side of the tool
  end type meeting_t

contains

  !> The deepest penetration, what the searches of each pair did, and tools that never touched.
  subroutine log_contact(log, model, run, is_complete, length_unit, energy_unit)
    type(run_log_t), intent(inout) :: log
    type(model_t), intent(in), target :: model
    type(run_t), intent(in) :: run
    logical, intent(in) :: is_complete     !! the run was not broken off
    character(*), intent(in) :: length_unit, energy_unit   !! for the log, or empty
    type(contact_view_t), allocatable :: pairs(:)
    type(meeting_t), allocatable :: meetings(:)
    character(:), allocatable :: unit
    integer :: i

    unit = ""
    if (length_unit /= "") unit = " "//length_unit
    pairs = [contact_pairs(model%retired), contact_pairs(model%forces)]
    if (size(pairs) == 0) return
    call log_depths(log, pairs, run%largest_penetration, unit)
    call log_searches(log, pairs)
    call log_line(log, work_words(pairs, model%bodies%tools, energy_unit))
    if (.not. is_complete) return
    meetings = meetings_of(pairs, model%bodies%tools)
    do i = 1, size(meetings)
      if (.not. meetings(i)%has_touched) call log_line(log, idle_words(meetings(i), &
        model%bodies%tools(meetings(i)%tool)%name, unit))
    end do
  end subroutine log_contact

  !> Depths at the contact points and between them, with pair, time and location of the greatest.
  subroutine log_depths(log, pairs, at_points, unit)
    type(run_log_t), intent(inout) :: log
    type(contact_view_t), intent(in) :: pairs(:)
    real(wp), intent(in) :: at_points      !! [length]
    character(*), intent(in) :: unit       !! of lengths, after a space; or empty
    character(:), allocatable :: location
    real(wp) :: deepest
    integer :: i

    deepest = at_points
    location = ", and no deeper between them"
    do i = 1, size(pairs)
      associate (pair => pairs(i)%pair)
        if (.not. pair%greatest%depth > deepest) cycle
        deepest = pair%greatest%depth
        location = ", between them "//rounded_text(deepest)//unit//" ("// &
                   percent(deepest/pair%thickness, 1)//" of the thickness): "//pair%name// &
                   " at time "//rounded_text(pair%greatest_time)//", at "// &
                   place_text(pair%greatest%x)
      end associate
    end do
    call log_line(log, "contact    deepest penetration "//rounded_text(at_points)//unit// &
                  " at contact points"//location)
  end subroutine log_depths

  !> What the contact searches did, pair by pair.
  subroutine log_searches(log, pairs)
    type(run_log_t), intent(inout) :: log
    type(contact_view_t), intent(in) :: pairs(:)
    integer :: i

    do i = 1, size(pairs)
      associate (s => pairs(i)%pair%pair%statistics)
        call log_line(log, pairs(i)%pair%name//": "//to_text(s%n_tested)//" of "// &
                      counted(s%n_points, "point")//" tested, "// &
                      percent(1 - real(s%n_tested, wp)/max(1.0_wp, real(s%n_points, wp)), 3)// &
                      " culled, "// &
                      rounded_text(real(s%n_iterations, wp)/max(1.0_wp, real(s%n_tested, wp)))// &
                      " face evaluations a point, at most "//to_text(s%max_iterations)//", "// &
                      counted(s%n_fallbacks, "fallback search", "fallback searches")//", "// &
                      to_text(s%n_failures)//" failed")
      end associate
    end do
  end subroutine log_searches

  !> Work of each tool on the blank: of its pairs, friction and penalty springs included.
  function work_words(pairs, tools, unit) result(words)
    type(contact_view_t), intent(in) :: pairs(:)
    type(tool_t), intent(in) :: tools(:)
    character(*), intent(in) :: unit         !! of energies, or empty
    character(:), allocatable :: words
    real(wp) :: work(size(tools))
    logical :: is_paired(size(tools))
    integer :: i, t

    work = 0.0_wp
    is_paired = .false.
    do i = 1, size(pairs)
      associate (pair => pairs(i)%pair)
        work(pair%tool) = work(pair%tool) + pair%external_work
        is_paired(pair%tool) = .true.
      end associate
    end do
    words = "contact    work of the tools on the blank:"
    do t = 1, size(tools)
      if (is_paired(t)) words = words//" "//tools(t)%name//" "//rounded_text(work(t))//","
    end do
    words = words(:len(words) - 1)//trim(" "//unit)//" (with friction and penalty springs)"
  end function work_words

  !> How tools and faces have met. Of a blank of several patches, and of a tool that a deck takes
  !! away and brings again, all pairs are one meeting.
  function meetings_of(pairs, tools) result(meetings)
    type(contact_view_t), intent(in) :: pairs(:)
    type(tool_t), intent(in) :: tools(:)
    type(meeting_t), allocatable :: meetings(:)
    real(wp), parameter :: round_off = 1.0e-6_wp   ! of the thickness: a sheet that lies on a tool
    integer :: i, k

    allocate (meetings(0))
    do i = 1, size(pairs)
      associate (pair => pairs(i)%pair)
        k = findloc(meetings%tool == pair%tool .and. meetings%face == pair%face, .true., dim=1)
        if (k == 0) then
          meetings = [meetings, meeting_t(pair%tool, pair%face)]
          k = size(meetings)
        end if
        associate (meeting => meetings(k))
          meeting%has_touched = meeting%has_touched .or. pair%has_touched
          if (pair%greatest%depth > round_off*pair%thickness) &
            meeting%depth = max(meeting%depth, pair%greatest%depth)
          if (.not. meeting%has_touched) &
            call find_nearest(pair, tools(pair%tool), meeting%nearest, meeting%is_behind)
        end associate
      end associate
    end do
  end function meetings_of

  !> How far from the blank a tool is that did not touch it.
  function idle_words(meeting, name, unit) result(words)
    type(meeting_t), intent(in) :: meeting
    character(*), intent(in) :: name         !! of the tool
    character(*), intent(in) :: unit         !! of lengths, after a space; or empty
    character(:), allocatable :: words

    words = "warning: tool "//name//" never touched the blank at a contact point: "
    if (meeting%depth > 0.0_wp) then
      words = words//"between these the blank was up to "//rounded_text(meeting%depth)//unit// &
              " deep in it, so use smaller elements or more contact points (COUNT)"
    else if (meeting%is_behind) then
      words = words//"in the end the blank is behind its surface, "// &
              rounded_text(meeting%nearest)//unit//" away, so the SIDE of the tool may be wrong"
    else if (meeting%nearest < huge(1.0_wp)) then
      words = words//"in the end it is "//rounded_text(meeting%nearest)//unit// &
              " away; check its location, its motion, its SIDE and the units of the deck"
    else
      words = words//"in the end no contact point lies opposite it; check its location "// &
              "and its motion"
    end if
  end function idle_words

  !> Distance to the nearest contact point that faces the tool, when the pair last acted.
  subroutine find_nearest(pair, tool, nearest, is_behind)
    type(contact_effect_t), intent(in) :: pair
    type(tool_t), intent(in) :: tool
    real(wp), intent(inout) :: nearest       !! of other pairs [length]
    logical, intent(inout) :: is_behind
    type(tool_t) :: tool_then
    real(wp) :: gaps(pair%pair%secondary%n_points)
    logical :: is_proper(pair%pair%secondary%n_points)
    integer :: i

    ! Of a pair that ended with its step the tool may have moved on.
    tool_then = tool
    tool_then%displacement = pair%pair%motion%displacement
    call face_gaps(pair%pair%secondary, tool_then, pair%pair%motion%now, gaps, is_proper)
    if (.not. any(is_proper)) return
    i = minloc(abs(gaps), 1, is_proper)
    if (abs(gaps(i)) >= nearest) return
    nearest = abs(gaps(i))
    is_behind = gaps(i) < 0.0_wp
  end subroutine find_nearest

  pure function percent(fraction, decimals) result(text)
    real(wp), intent(in) :: fraction
    integer, intent(in) :: decimals
    character(:), allocatable :: text
    character(24) :: buffer

    write (buffer, "(f20."//to_text(decimals)//")") 100.0_wp*fraction
    text = trim(adjustl(buffer))//" %"
  end function percent

end module contact_report
