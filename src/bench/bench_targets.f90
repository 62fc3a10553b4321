!> What the program is to reach, and whether it does.
!!
!! The absolute times are for processors with 512-bit registers at about 2.5 GHz; those that are
!! ratios of one run hold anywhere.
module bench_targets
  use kinds, only: wp
  use text, only: to_text
  use bench_record, only: record_t, record_list_t, find_record
  implicit none
  private

  public :: set_targets, target_lines

  character(1), parameter :: feed = new_line("a")
  real(wp), parameter :: rational_factor = 1.6_wp   !! weights over none

  !> Force routine with von Mises and Voce, without weights [ns an element and step].
  type :: force_target_t
    character(8) :: rule
    real(wp) :: ns(2)            !! one and two threads
  end type force_target_t

  type(force_target_t), parameter :: force_targets(3) = [ &
    force_target_t("3x3x3", [412.5_wp, 212.5_wp]), &
    force_target_t("2x2x3", [218.75_wp, 115.0_wp]), &
    force_target_t("2x2x2", [187.5_wp, 97.5_wp])]

contains

  !> Give the records that have a target their target.
  subroutine set_targets(records)
    type(record_list_t), intent(inout) :: records
    integer :: i, part

    do i = 1, records%n
      associate (record => records%items(i))
        if (index(record%name, "force/p2/") == 1) record%target = force_target(record)
        part = 0
        if (record%name == "step/channel") &
          part = find_record(records, "step/channel/blank", record%threads)
        if (part > 0) record%target = 1.5_wp*records%items(part)%ns
      end associate
    end do
  end subroutine set_targets

  !> Target of a force routine, negative if there is none.
  pure real(wp) function force_target(record) result(ns)
    type(record_t), intent(in) :: record
    character(:), allocatable :: stem
    integer :: i

    ns = -1.0_wp
    if (record%threads > 2) return
    do i = 1, size(force_targets)
      stem = "force/p2/"//trim(force_targets(i)%rule)//"/voce/"
      if (index(record%name, stem) /= 1) cycle
      ns = force_targets(i)%ns(record%threads)
      if (index(record%name, "/rational/") > 0) ns = rational_factor*ns
      if (record%name(index(record%name, "/", back=.true.) + 1:) /= "default") ns = -1.0_wp
    end do
  end function force_target

  !> The targets of a run, line by line: met or missed. Empty if no record has one.
  function target_lines(records) result(lines)
    type(record_list_t), intent(in) :: records
    character(:), allocatable :: lines
    integer :: i

    lines = ""
    do i = 1, records%n
      associate (record => records%items(i))
        if (record%target < 0.0_wp) cycle
        lines = lines//verdict(record%name//", "//to_text(record%threads)//" threads, ns", &
                               record%ns, record%target, record%ns <= record%target, &
                               reason(record))
      end associate
    end do
    do i = 1, records%n
      associate (record => records%items(i))
        if (record%threads > 1 .or. index(record%name, "/voce/plain/default") == 0) cycle
        if (record%memory_ratio < 0.0_wp) cycle
        lines = lines//verdict(record%name//", memory over state", record%memory_ratio, 2.0_wp, &
                               record%memory_ratio <= 2.0_wp)
      end associate
    end do
    lines = lines//weight_lines(records)//general_lines(records)//smooth_lines(records)
    lines = lines//efficiency_line(records, "force/p2/2x2x3/voce/plain/default", 0.95_wp)
    lines = lines//efficiency_line(records, "elements/8000", 0.90_wp)
    lines = lines//growth_lines(records, "contact/faces/")//growth_lines(records, "search/faces/") &
            //growth_lines(records, "contact/refined/")//growth_lines(records, "search/refined/")
    lines = lines//contact_line(records)
  end function target_lines

  !> Weights over none, a ratio of one run, which holds on any processor.
  function weight_lines(records) result(lines)
    type(record_list_t), intent(in) :: records
    character(:), allocatable :: lines, stem
    integer :: i, threads

    lines = ""
    do threads = 1, 2
      do i = 1, size(force_targets)
        stem = "force/p2/"//trim(force_targets(i)%rule)//"/voce/"
        lines = lines &
          //ratio_line(records, stem//"rational/default", stem//"plain/default", threads, &
                       rational_factor)
      end do
    end do
  end function weight_lines

  function ratio_line(records, above, below, threads, most) result(line)
    type(record_list_t), intent(in) :: records
    character(*), intent(in) :: above, below     !! names of records
    integer, intent(in) :: threads
    real(wp), intent(in) :: most
    character(:), allocatable :: line
    integer :: i, j
    real(wp) :: ratio

    line = ""
    i = find_record(records, above, threads)
    j = find_record(records, below, threads)
    if (i == 0 .or. j == 0) return
    ratio = records%items(i)%ns/records%items(j)%ns
    line = verdict(above//", "//to_text(threads)//" threads, over plain", ratio, most, &
                   ratio <= most)
  end function ratio_line

  function efficiency_line(records, name, least) result(line)
    type(record_list_t), intent(in) :: records
    character(*), intent(in) :: name
    real(wp), intent(in) :: least
    character(:), allocatable :: line
    integer :: one, two
    real(wp) :: efficiency

    line = ""
    one = find_record(records, name, 1)
    two = find_record(records, name, 2)
    if (one == 0 .or. two == 0) return
    efficiency = records%items(one)%ns/(2.0_wp*records%items(two)%ns)
    line = verdict(name//", efficiency of two threads", efficiency, least, efficiency >= least)
  end function efficiency_line

  !> What has no instance of its own, against the one with 3 x 3 x 3 points, point by point.
  function general_lines(records) result(lines)
    type(record_list_t), intent(in) :: records
    character(:), allocatable :: lines
    real(wp), parameter :: most = 3.0_wp
    character(8), parameter :: rules(8) = [character(8) :: "p1/1x1x2", "p1/2x2x2", "p2/2x3x2", &
      "p2/3x3x4", "p3/3x3x3", "p3/4x4x4", "p4/4x4x4", "p5/5x5x5"]
    integer :: i, general, tuned
    real(wp) :: ratio

    lines = ""
    tuned = find_record(records, "force/p2/3x3x3/voce/plain/default", 1)
    if (tuned == 0) return
    do i = 1, size(rules)
      general = find_record(records, "force/"//rules(i)//"/voce/plain/default", 1)
      if (general == 0) cycle
      ratio = records%items(general)%ns_per_point/records%items(tuned)%ns_per_point
      lines = lines//verdict(records%items(general)%name//", a point over 3x3x3", ratio, most, &
                             ratio <= most)
    end do
  end function general_lines

  !> Projections, which go through a general routine of their own, against the plain general one,
  !! point by point.
  function smooth_lines(records) result(lines)
    type(record_list_t), intent(in) :: records
    character(:), allocatable :: lines
    real(wp), parameter :: most = 3.0_wp
    integer :: i, general
    real(wp) :: ratio

    lines = ""
    general = find_record(records, "force/p2/3x3x4/voce/plain/default", 1)
    if (general == 0) return
    do i = 1, records%n
      associate (record => records%items(i))
        if (record%threads > 1 .or. index(record%name, "_smooth") == 0) cycle
        ratio = record%ns_per_point/records%items(general)%ns_per_point
        lines = lines//verdict(record%name//", over plain", ratio, most, ratio <= most)
      end associate
    end do
  end function smooth_lines

  !> Cost may grow as the logarithm of the number of faces: from 100 to 10^5 by 2.5, to 10^6 by 3.
  function growth_lines(records, stem) result(lines)
    type(record_list_t), intent(in) :: records
    character(*), intent(in) :: stem
    character(:), allocatable :: lines
    integer :: few, many, power
    real(wp) :: growth

    lines = ""
    few = find_record(records, stem//"100", 1)
    if (few == 0) return
    do power = 5, 6
      many = find_record(records, stem//to_text(10**power), 1)
      if (many == 0) cycle
      growth = records%items(many)%ns/records%items(few)%ns
      lines = lines//verdict(records%items(many)%name//" over 100", growth, 0.5_wp*power, &
                             growth <= 0.5_wp*power)
    end do
  end function growth_lines

  !> Contact must not cost more than the elements in the channel.
  function contact_line(records) result(line)
    type(record_list_t), intent(in) :: records
    character(:), allocatable :: line
    character(*), parameter :: stem = "step/channel/contact"
    integer :: i, elements
    real(wp) :: share

    line = ""
    elements = find_record(records, "step/channel/blank", 1)
    if (elements == 0) return
    share = 0.0_wp
    do i = 1, records%n
      if (records%items(i)%threads == 1 .and. index(records%items(i)%name, stem) == 1) &
        share = share + records%items(i)%ns
    end do
    share = share/records%items(elements)%ns
    line = verdict("step/channel, contact over elements", share, 1.0_wp, share <= 1.0_wp)
  end function contact_line

  !> What a missed time would ask of this processor: the absolute ones were set on another.
  function reason(record) result(words)
    type(record_t), intent(in) :: record
    character(:), allocatable :: words

    words = ""
    if (record%ns <= record%target .or. record%share_of_bound < 0.0_wp) return
    words = ", which would take "// &
            to_text(nint(100.0_wp*record%share_of_bound*record%ns/record%target))// &
            " % of this processor's bound"
  end function reason

  pure function verdict(what, value, limit, is_met, why) result(line)
    character(*), intent(in) :: what
    real(wp), intent(in) :: value, limit
    logical, intent(in) :: is_met
    character(*), intent(in), optional :: why    !! behind the target
    character(:), allocatable :: line
    character(120) :: buffer

    write (buffer, "(a6, 2x, a62, f10.2, a, f8.2)") merge("met   ", "missed", is_met), &
      what//repeat(" ", 62), value, "  target", limit
    line = trim(buffer)
    if (present(why)) line = line//why
    line = line//feed
  end function verdict

end module bench_targets
