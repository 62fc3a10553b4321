!> For the log: the processes of a run, how evenly they worked and what passed between them.
module process_report
  use, intrinsic :: iso_fortran_env, only: int64
  use kinds, only: wp
  use text, only: string_t, append_text, to_text, rounded_text, counted
  use timer, only: ticks_to_seconds
  use ranks, only: ranks_t, traffic_t, sum_traffic
  use model, only: model_t
  use contact_effect, only: contact_view_t, contact_pairs
  implicit none
  private

  public :: process_line, process_lines

contains

  !> Number of processes, their threads and machines. All processes call it.
  function process_line(ranks, n_threads) result(line)
    class(ranks_t), intent(in) :: ranks
    integer, intent(in) :: n_threads             !! of each process
    character(:), allocatable :: line, host
    type(string_t), allocatable :: hosts(:)
    integer, allocatable :: numbers(:)
    integer :: r, i

    allocate (hosts(0), numbers(0))
    do r = 0, ranks%n - 1
      host = ranks%host()
      call ranks%share_text(host, r)
      do i = 1, size(hosts)
        if (hosts(i)%value == host) exit
      end do
      if (i > size(hosts)) then
        call append_text(hosts, host)
        numbers = [numbers, 0]
      end if
      numbers(i) = numbers(i) + 1
    end do
    line = "processes  "//to_text(ranks%n)//" with "//counted(n_threads, "thread")//" each"
    line = line//", on "//hosts(1)%value
    do i = 1, size(hosts)
      if (i > 1) line = line//", "//hosts(i)%value
      if (size(hosts) > 1) line = line//" ("//to_text(numbers(i))//")"
    end do
  end function process_line

  !> Balance of the work, and what was exchanged. All processes call it.
  function process_lines(model, wall_seconds) result(lines)
    type(model_t), intent(in), target :: model   !! with processes
    real(wp), intent(in) :: wall_seconds         !! of all steps
    type(string_t), allocatable :: lines(:)
    type(contact_view_t), allocatable :: pairs(:)
    type(traffic_t) :: elements, contacts
    real(wp) :: own(2), joined(2*model%ranks%n), works(2, model%ranks%n)
    real(wp) :: waiting(1), waits(model%ranks%n)
    integer :: i

    own = 0.0_wp
    do i = 1, size(model%bodies%blank%parts)
      own(1) = own(1) + sum(model%bodies%blank%parts(i)%element%tile_costs([real(wp) ::]))
      call model%bodies%blank%parts(i)%element%add_traffic(elements)
    end do
    pairs = [contact_pairs(model%forces), contact_pairs(model%retired)]
    do i = 1, size(pairs)
      associate (pair => pairs(i)%pair%pair)
        if (allocated(pair%ticks)) own(2) = own(2) + sum(real(pair%ticks, wp))
        call sum_traffic(pair%traffic, contacts)
      end associate
    end do
    call model%ranks%gather(spread(2, 1, model%ranks%n), own, joined, .true.)
    works = reshape(joined, shape(works))
    waiting = ticks_to_seconds(elements%ticks + contacts%ticks)
    call model%ranks%gather(spread(1, 1, model%ranks%n), waiting, waits, .true.)
    allocate (lines(0))
    call append_text(lines, "balance    work of the busiest process over the mean: elements "// &
                     ratio(works(1, :))//", contact "//ratio(works(2, :)))
    call append_text(lines, "exchange   "//per_call(elements)//" kB of forces in each "// &
      "evaluation, "//per_call(contacts)//" kB for each exchange of contact, "// &
      rounded_text(minval(waits))//" to "//rounded_text(maxval(waits))//" s of "// &
      rounded_text(wall_seconds)//" s in the processes, waiting for each other included")
  end function process_lines

  !> What an exchange brings to each process [kB].
  function per_call(traffic) result(words)
    type(traffic_t), intent(in) :: traffic
    character(:), allocatable :: words

    words = rounded_text(8.0e-3_wp*traffic%n_values/max(1_int64, traffic%n_calls))
  end function per_call

  !> The largest over the mean.
  function ratio(works) result(words)
    real(wp), intent(in) :: works(:)
    character(:), allocatable :: words

    words = "1"
    if (sum(works) > 0.0_wp) words = rounded_text(maxval(works)*size(works)/sum(works))
  end function ratio

end module process_report
