!> Quantities against time: balances, tool forces, probes. Collected in memory between frames.
module history
  use, intrinsic :: iso_fortran_env, only: int64
  use kinds, only: wp
  use text, only: string_t
  use hdf5_file, only: create_group, hdf5_file_t, integer_values, link_object, real_values, &
                       write_integer_attribute
  use hdf5_series, only: append_reals, create_series
  use unit_system, only: unit_of, unit_system_t
  implicit none
  private

  public :: history_t, history_row_t, open_history, record_row, write_history, forget_rows, &
            n_waiting_rows

  integer, parameter :: n_chunk_rows = 256

  !> All quantities at one time. Zero where nothing is set.
  type :: history_row_t
    integer(int64) :: step = 0
    integer :: process_step = 1            !! step of the deck
    real(wp) :: time = 0.0_wp, dt = 0.0_wp
    real(wp) :: kinetic_energy = 0.0_wp, internal_energy = 0.0_wp, plastic_work = 0.0_wp
    real(wp) :: contact_energy = 0.0_wp, friction_energy = 0.0_wp, viscous_energy = 0.0_wp
    real(wp) :: damping_energy = 0.0_wp
    real(wp) :: external_work = 0.0_wp
    real(wp) :: energy_error = 0.0_wp      !! relative, see the description in the file
    real(wp) :: max_penetration = 0.0_wp   !! [length]
    real(wp) :: true_penetration = 0.0_wp  !! [length]
    real(wp) :: added_mass = 0.0_wp        !! by mass scaling [mass]
    real(wp) :: momentum(3) = 0.0_wp
    real(wp) :: angular_momentum(3) = 0.0_wp   !! about the origin
    real(wp), allocatable :: tool_displacement(:, :), tool_force(:, :)        !! (3, tools)
    real(wp), allocatable :: tool_torque(:, :)   !! (3, tools), of those that turn
    real(wp), allocatable :: probe_displacement(:, :), probe_velocity(:, :)   !! (3, probes)
  end type history_row_t

  ! A dataset that grows by one row for each history time.
  type :: column_t
    character(:), allocatable :: path
    integer :: n = 1                         ! components
    integer :: first = 0                     ! place in the packed row
  end type column_t

  !> Columns and the rows not written yet.
  type :: history_t
    private
    type(column_t), allocatable :: columns(:)
    integer :: n_tools = 0, n_probes = 0
    logical, allocatable :: is_turning(:)    ! for each tool
    integer :: n_values = 0                  ! length of a packed row
    integer :: n_rows = 0                    ! rows waiting
    real(wp), allocatable :: rows(:, :)      ! (n_values, room)
  end type history_t

contains

  !> Create the datasets under /history and /tools; those of a file that is gone on with stay.
  subroutine open_history(history, file, units, tools, is_turning, probes)
    type(history_t), intent(out) :: history
    type(hdf5_file_t), intent(inout) :: file
    type(unit_system_t), intent(in) :: units
    type(string_t), intent(in) :: tools(:), probes(:)   !! names
    logical, intent(in) :: is_turning(size(tools))      !! their torques are kept
    integer :: i

    allocate (history%columns(0))
    history%n_tools = size(tools)
    history%n_probes = size(probes)
    history%is_turning = is_turning
    call add_balances(history, file, units)
    call create_group(file, "/tools")
    do i = 1, size(tools)
      associate (folder => "/tools/"//tools(i)%value)
        call add(history, file, folder//"/displacement", 3, unit_of(units, "length"), &
                 "displacement of the tool from its place at the start")
        call add(history, file, folder//"/force", 3, unit_of(units, "force"), &
                 "force of the blank on the tool")
        if (is_turning(i)) &
          call add(history, file, folder//"/torque", 3, unit_of(units, "moment"), &
                   "moment of this force about the point on the axis that the deck gives, "// &
                   "which goes with the tool; its part along the axis turns the tool")
        call link_object(file, "/history/time", folder//"/time")
        call write_integer_attribute(file, folder, "part", [i])
      end associate
    end do
    do i = 1, size(probes)
      associate (folder => "/history/probes/"//probes(i)%value)
        call add(history, file, folder//"/displacement", 3, unit_of(units, "length"), &
                 "displacement of the probe")
        call add(history, file, folder//"/velocity", 3, unit_of(units, "velocity"), &
                 "velocity of the probe")
      end associate
    end do
    allocate (history%rows(history%n_values, n_chunk_rows))
  end subroutine open_history

  ! The order is that of `packed`.
  subroutine add_balances(history, file, units)
    type(history_t), intent(inout) :: history
    type(hdf5_file_t), intent(inout) :: file
    type(unit_system_t), intent(in) :: units
    character(:), allocatable :: energy

    energy = unit_of(units, "energy")
    call add(history, file, "/history/step", 1, "1", "number of steps done", integer_values)
    call add(history, file, "/history/process_step", 1, "1", "step of the deck, from 1 on", &
             integer_values)
    call add(history, file, "/history/time", 1, unit_of(units, "time"), "time")
    call add(history, file, "/history/dt", 1, unit_of(units, "time"), "length of the last step")
    call add(history, file, "/history/kinetic_energy", 1, energy, "kinetic energy of the blank")
    call add(history, file, "/history/internal_energy", 1, energy, &
             "work of the stresses since the start")
    call add(history, file, "/history/plastic_work", 1, energy, "dissipated part of it")
    call add(history, file, "/history/contact_energy", 1, energy, &
             "work done against the contact springs")
    call add(history, file, "/history/friction_energy", 1, energy, "work done against friction")
    call add(history, file, "/history/viscous_energy", 1, energy, &
             "work done against bulk viscosity")
    call add(history, file, "/history/damping_energy", 1, energy, "work done against damping")
    call add(history, file, "/history/external_work", 1, energy, &
             "work of tools, loads and prescribed motion")
    call add(history, file, "/history/energy_error", 1, "1", "balance of all energies over the " &
             //"largest of initial energy, |external work| and kinetic + internal energy")
    call add(history, file, "/history/max_penetration", 1, unit_of(units, "length"), &
             "largest depth of a contact point of the blank in a tool since the row before")
    call add(history, file, "/history/true_penetration", 1, unit_of(units, "length"), &
             "depth of the deepest place of the blank in a tool now, between contact points too")
    call add(history, file, "/history/added_mass", 1, unit_of(units, "mass"), &
             "mass added by scaling; of scaling through the thickness a third of the "// &
             "trace of the added mass matrix")
    call add(history, file, "/history/momentum", 3, unit_of(units, "momentum"), &
             "linear momentum of the blank")
    call add(history, file, "/history/angular_momentum", 3, unit_of(units, "angular momentum"), &
             "angular momentum of the blank about the origin, without added mass")
  end subroutine add_balances

  !> Keep a row until the next `write_history`; nothing is written here.
  subroutine record_row(history, row)
    type(history_t), intent(inout) :: history
    type(history_row_t), intent(in) :: row
    real(wp), allocatable :: wider(:, :)

    if (history%n_rows == size(history%rows, 2)) then
      allocate (wider(history%n_values, 2*history%n_rows))
      wider(:, :history%n_rows) = history%rows
      call move_alloc(wider, history%rows)
    end if
    history%n_rows = history%n_rows + 1
    history%rows(:, history%n_rows) = packed(history, row)
  end subroutine record_row

  !> Rows that wait.
  pure integer function n_waiting_rows(history)
    type(history_t), intent(in) :: history

    n_waiting_rows = history%n_rows
  end function n_waiting_rows

  !> Let go of the rows that wait, but for the first.
  pure subroutine forget_rows(history, n_kept)
    type(history_t), intent(inout) :: history
    integer, intent(in) :: n_kept          !! first ones that go on waiting

    history%n_rows = min(history%n_rows, n_kept)
  end subroutine forget_rows

  !> Append the waiting rows, or the first of them, to the datasets; the others go on waiting.
  subroutine write_history(history, file, n_rows)
    type(history_t), intent(inout) :: history
    type(hdf5_file_t), intent(inout) :: file
    integer, intent(in), optional :: n_rows    !! absent: all
    integer :: i, n

    n = history%n_rows
    if (present(n_rows)) n = min(n, n_rows)
    do i = 1, size(history%columns)
      associate (c => history%columns(i))
        call append_reals(file, c%path, [history%rows(c%first:c%first + c%n - 1, &
                                                      :n)], row_shape(c%n), n)
      end associate
    end do
    history%rows(:, :history%n_rows - n) = history%rows(:, n + 1:history%n_rows)
    history%n_rows = history%n_rows - n
  end subroutine write_history

  subroutine add(history, file, path, n, unit, description, kind_of_values)
    type(history_t), intent(inout) :: history
    type(hdf5_file_t), intent(inout) :: file
    character(*), intent(in) :: path, unit, description
    integer, intent(in) :: n
    integer, intent(in), optional :: kind_of_values
    type(column_t) :: column

    if (present(kind_of_values)) then
      call create_series(file, path, kind_of_values, row_shape(n), n_chunk_rows, &
                         .false., unit, description)
    else
      call create_series(file, path, real_values, row_shape(n), n_chunk_rows, &
                         .false., unit, description)
    end if
    column%path = path
    column%n = n
    column%first = history%n_values + 1
    history%n_values = history%n_values + n
    history%columns = [history%columns, column]
  end subroutine add

  pure function row_shape(n) result(shape)
    integer, intent(in) :: n
    integer, allocatable :: shape(:)

    if (n == 1) then
      allocate (shape(0))
    else
      shape = [n]
    end if
  end function row_shape

  ! One row in the order of the columns.
  pure function packed(history, row) result(values)
    type(history_t), intent(in) :: history
    type(history_row_t), intent(in) :: row
    real(wp) :: values(history%n_values)
    integer :: first, i

    values(:22) = [real(row%step, wp), real(row%process_step, wp), row%time, row%dt, &
                   row%kinetic_energy, row%internal_energy, row%plastic_work, row%contact_energy, &
                   row%friction_energy, row%viscous_energy, row%damping_energy, &
                   row%external_work, row%energy_error, row%max_penetration, row%true_penetration, &
                   row%added_mass, row%momentum, row%angular_momentum]
    first = 23
    do i = 1, history%n_tools
      values(first:first + 5) = [row%tool_displacement(:, i), row%tool_force(:, i)]
      first = first + 6
      if (.not. history%is_turning(i)) cycle
      values(first:first + 2) = row%tool_torque(:, i)
      first = first + 3
    end do
    do i = 1, history%n_probes
      values(first:first + 5) = [row%probe_displacement(:, i), row%probe_velocity(:, i)]
      first = first + 6
    end do
  end function packed

end module history
