!> For the log: the processes of a run, how evenly they worked, what passed between them and their
!! memory.
module process_report
  use, intrinsic :: iso_fortran_env, only: int64
  use kinds, only: wp
  use text, only: string_t, append_text, to_text, rounded_text, counted
  use timer, only: ticks_to_seconds
  use free_memory, only: most_megabytes
  use ranks, only: ranks_t, traffic_t, sum_traffic
  use model, only: model_t
  use row_shares, only: row_shares_t
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

  !> Who moved what, balance of the work, what was exchanged, and memory. All processes call it.
  function process_lines(model, shared_at, wall_seconds) result(lines)
    type(model_t), intent(in), target :: model   !! with processes
    integer(int64), intent(in) :: shared_at      !! increment at which they last shared the work
    real(wp), intent(in) :: wall_seconds         !! of all steps
    type(string_t), allocatable :: lines(:)
    type(contact_view_t), allocatable :: pairs(:)
    type(traffic_t) :: traffic
    integer(int64) :: n_evaluations
    real(wp) :: own(5), joined(5*model%ranks%n), all_values(5, model%ranks%n)
    integer :: n_active, i

    own = 0.0_wp
    call model%bodies%blank%parts(1)%element%add_traffic(traffic)
    ! Each of them makes one exchange there, or where each moves but some rows one here.
    n_evaluations = max(1_int64, traffic%n_calls + model%bodies%blank%n_exchanges)
    traffic = model%bodies%blank%traffic
    do i = 1, size(model%bodies%blank%parts)
      own(1) = own(1) + sum(model%bodies%blank%parts(i)%element%tile_costs([real(wp) ::]))
      call model%bodies%blank%parts(i)%element%add_traffic(traffic)
    end do
    pairs = contact_pairs(model%forces)
    n_active = size(pairs)
    pairs = [pairs, contact_pairs(model%retired)]
    do i = 1, size(pairs)
      associate (pair => pairs(i)%pair%pair)
        if (allocated(pair%ticks) .and. i <= n_active) own(2) = own(2) + sum(real(pair%ticks, wp))
        call sum_traffic(pair%traffic, traffic)
      end associate
    end do
    own(3) = 8.0e-3_wp*traffic%n_values/n_evaluations
    own(4) = ticks_to_seconds(traffic%ticks)
    own(5) = most_megabytes()
    call model%ranks%gather(spread(5, 1, model%ranks%n), own, joined, .true.)
    all_values = reshape(joined, shape(all_values))
    allocate (lines(0))
    call append_text(lines, rows_line(model%bodies%blank%parts(1)%element%motion%rows, &
                                      size(model%bodies%blank%parts(1)%element%mass, 2)))
    call append_text(lines, &
      "balance    work of the busiest process over the mean since increment "// &
      to_text(shared_at)//": elements "//ratio(all_values(1, :))//", contact "// &
      ratio(all_values(2, :))//", together "//ratio(sum(all_values(:2, :), 1)))
    call append_text(lines, "exchange   up to "//rounded_text(maxval(all_values(3, :)))// &
      " kB received by a process in each increment, "//rounded_text(minval(all_values(4, :)))// &
      " to "//rounded_text(maxval(all_values(4, :)))//" s of "//rounded_text(wall_seconds)// &
      " s in the processes, waiting for each other included")
    call append_text(lines, memory_line(all_values(5, :)))
  end function process_lines

  !> The first process takes more: it writes the results.
  function memory_line(megabytes) result(line)
    real(wp), intent(in) :: megabytes(:)         !! at most, of each process
    character(:), allocatable :: line

    line = "memory     at most "//to_text(nint(megabytes(1)))//" MB"
    if (size(megabytes) > 1) line = line//" in the first process, "// &
                                    to_text(nint(maxval(megabytes(2:))))//" MB in any other"
  end function memory_line

  !> How many rows of control points the processes move.
  pure function rows_line(rows, n) result(line)
    type(row_shares_t), intent(in) :: rows       !! as they were shared last
    integer, intent(in) :: n                     !! all of them
    character(:), allocatable :: line

    line = "rows       each process moves all control points"
    if (.not. allocated(rows%last_of)) return
    associate (moved => rows%moved_by(2, :) - rows%moved_by(1, :) + 1)
      line = "rows       of "//to_text(n)//" rows of control points each process moves "// &
             to_text(minval(moved))//" to "//to_text(maxval(moved))
    end associate
  end function rows_line

  !> The largest over the mean.
  function ratio(works) result(words)
    real(wp), intent(in) :: works(:)
    character(:), allocatable :: words

    words = "1"
    if (sum(works) > 0.0_wp) words = rounded_text(maxval(works)*size(works)/sum(works))
  end function ratio

end module process_report
