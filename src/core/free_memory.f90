!> How much memory this program may still take.
module free_memory
  use, intrinsic :: iso_c_binding, only: c_int, c_size_t
  use kinds, only: wp
  implicit none
  private

  public :: free_megabytes

  real(wp), parameter :: kilobyte = 1024.0_wp, megabyte = 1048576.0_wp

  interface
    integer(c_int) function c_getrlimit(kind, limits) bind(C, name="getrlimit")
      import :: c_int, c_size_t
      integer(c_int), value :: kind
      integer(c_size_t), intent(out) :: limits(2)
    end function c_getrlimit
  end interface

contains

  !> The least of what the machine has to give, what `ulimit -v` leaves and what the control group
  !! leaves (containers, batch systems) [MB]. Huge where nothing is known.
  real(wp) function free_megabytes() result(megabytes)
    integer(c_int), parameter :: address_space = 9_c_int   ! of Linux
    integer(c_size_t) :: limits(2)                         ! negative: none
    real(wp) :: available, limit, used

    megabytes = huge(megabytes)
    available = number_in("/proc/meminfo", "MemAvailable:")
    if (available >= 0.0_wp) megabytes = available*kilobyte/megabyte
    used = number_in("/proc/self/status", "VmSize:")
    if (c_getrlimit(address_space, limits) /= 0) limits = -1
    if (limits(1) >= 0 .and. used >= 0.0_wp) &
      megabytes = min(megabytes, real(limits(1), wp)/megabyte - used*kilobyte/megabyte)
    limit = number_in("/sys/fs/cgroup/memory.max", "")
    used = number_in("/sys/fs/cgroup/memory.current", "")
    if (limit >= 0.0_wp .and. used >= 0.0_wp) &
      megabytes = min(megabytes, (limit - used)/megabyte)
    megabytes = max(megabytes, 0.0_wp)
  end function free_megabytes

  !> The number behind a word in a file of the system, of the first line where there is no word;
  !! negative where there is none.
  real(wp) function number_in(file, word) result(number)
    character(*), intent(in) :: file, word
    character(200) :: line
    integer :: unit, status

    number = -1.0_wp
    open (newunit=unit, file=file, action="read", status="old", iostat=status)
    if (status /= 0) return
    do
      read (unit, "(a)", iostat=status) line
      if (status /= 0) exit
      if (index(line, word) /= 1) cycle
      read (line(len(word) + 1:), *, iostat=status) number
      if (status /= 0) number = -1.0_wp
      exit
    end do
    close (unit, iostat=status)
  end function number_in

end module free_memory
